"""What the buttons do: export, run the program, load what it wrote."""

import os
import shutil
import tempfile

import bpy

from . import material, sequence
from .errors import BakeError
from .job import Job, bakeCommand
from .preferences import findProgram
from .scene_export import exportScene, mediumInFile, scaleOf

TICK = 0.1  # seconds between looks at the program
NOT_CONVERGED = 4  # exit status; the output is written


def _absolute(volume, path):
    return os.path.normpath(bpy.path.abspath(path, library=volume.library))


def _materialOf(volume_object):
    return volume_object.material_slots[0].material if volume_object.material_slots else None


def _assign(volume_object, new):
    if volume_object.material_slots:
        volume_object.material_slots[0].material = new
    else:
        volume_object.data.materials.append(new)


class Bake:
    """One bake of one volume: start it, look at its job, then finish or drop it."""

    def __init__(self, context, volume_object, warn):
        """Raises BakeError, with nothing left behind, where the scene cannot be baked."""
        self.name, self.folder = volume_object.name, tempfile.mkdtemp(prefix="vdb_diffuse_")
        try:
            self._start(context, volume_object, warn)
        except BaseException:
            self.drop()
            raise

    def _start(self, context, volume_object, warn):
        volume = volume_object.data
        settings = volume.vdb_diffuse
        program = findProgram(context)
        self._remember(volume_object)
        if volume.users > 1:
            warn(f"{volume.users} objects share this volume: its light is right for '{self.name}' only")
        source = _absolute(volume, settings.source)
        output = self._outputOf(volume, source)
        scale = scaleOf(volume_object.matrix_world, self.name)
        # The new material has the medium in the unit of the old one, which Cycles scales alike.
        self.medium = mediumInFile(volume, settings.source_material, 1.0, warn)
        in_file = mediumInFile(volume, settings.source_material, scale, lambda _: None)
        self.has_flux = self.medium["g"] != 0
        if self.has_flux and settings.material_kind == "BAKED":
            warn("with anisotropy, 'All Baked' shows light that scatters once as if isotropic: see Material")
        os.makedirs(os.path.dirname(output), exist_ok=True)
        numbers = self._numbers(volume, source, warn)
        pairs = [(n - 1 - volume.frame_offset + volume.frame_start, n) for n in numbers]
        scene = exportScene(context, volume_object, in_file, self.folder, warn,
                            pairs if settings.animated_lights else None)
        self.output = output
        if numbers:
            source, output = sequence.pattern(source), sequence.pattern(output)
        self.job = Job(bakeCommand(program, source, output, scene, settings.sweeps, self.has_flux,
                                   sequence.ranges(numbers)))

    def _remember(self, volume_object):
        """What is there now is the source, unless the last bake left it."""
        volume, settings = volume_object.data, volume_object.data.vdb_diffuse
        if not volume.filepath:
            raise BakeError(f"'{self.name}' has no VDB file: import one (Add > Volume > Import OpenVDB)")
        if not settings.source or volume.filepath != settings.baked_file:
            settings.source, settings.source_clipping = volume.filepath, volume.render.clipping
        current = _materialOf(volume_object)
        if current is not settings.baked_material or current is None:
            settings.source_material = current

    def _outputOf(self, volume, source):
        """Beside the source, or in the folder asked for; not where another volume of the same source has its light."""
        folder = volume.vdb_diffuse.output_folder
        folder = _absolute(volume, folder) if folder else ""
        taken = {_absolute(other, other.vdb_diffuse.baked_file) for other in bpy.data.volumes
                 if other != volume and other.vdb_diffuse.baked_file}
        output = sequence.litPath(source, folder, volume.is_sequence)
        if output in taken:
            output = sequence.litPath(source, folder, volume.is_sequence, f"lit_{bpy.path.clean_name(volume.name)}")
        return output

    def _numbers(self, volume, source, warn):
        """Numbers of a sequence's files that are there; none for a single file."""
        if not volume.is_sequence:
            return []
        if sequence.pattern(source) is None:
            raise BakeError(f"{source} has no frame number: clear Sequence, or name the files name_0001.vdb")
        numbers = [volume.frame_offset + i for i in range(1, volume.frame_duration + 1)]
        missing = sequence.gaps(source, numbers)
        if missing:
            warn(f"no file for {sequence.ranges(missing)} of the sequence {source}: nothing shows there")
        numbers = [n for n in numbers if n not in missing]
        if not numbers:
            raise BakeError(f"no file of the sequence {source} is there: correct the path or the frames")
        return numbers

    def finish(self, warn):
        """Loads the result. Raises BakeError where the program failed."""
        report, status = self.job.report, self.job.status
        self.drop()
        if status not in (0, NOT_CONVERGED):
            said = report.errors or report.warnings or [f"vdb_diffuse ended with status {status}"]
            raise BakeError("; ".join(said))
        for line in report.warnings:
            warn(line)
        volume_object = bpy.data.objects.get(self.name)
        if volume_object is None or volume_object.type != "VOLUME":
            raise BakeError(f"'{self.name}' is gone; its light is in {self.output}")
        volume, settings = volume_object.data, volume_object.data.vdb_diffuse
        self._load(volume)
        settings.baked_file = self.output
        volume.render.clipping = 0  # or Cycles leaves out thin edges, which carry light
        if settings.baked_material is None:
            settings.baked_material = bpy.data.materials.new(f"{volume.name} lit")
        material.build(settings.baked_material, self.medium, settings.material_kind, self.has_flux)
        _assign(volume_object, settings.baked_material)

    def _load(self, volume):
        """Blender keeps a file's grids by name for as long as anyone holds them: an earlier bake has to go first."""
        volume.filepath = ""
        for view_layer in [layer for scene in bpy.data.scenes for layer in scene.view_layers]:
            view_layer.update()
        volume.grids.unload()
        volume.filepath = self.output

    def drop(self):
        shutil.rmtree(self.folder, ignore_errors=True)


class VDB_DIFFUSE_OT_bake(bpy.types.Operator):
    """Compute the light inside this volume, and show it by a new material. Esc cancels"""

    bl_idname = "vdb_diffuse.bake"
    bl_label = "Bake Diffuse Lighting"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "VOLUME"

    def _warn(self, text):
        self.report({"WARNING"}, text)

    def _begin(self, context):
        try:
            self.bake = Bake(context, context.object, self._warn)
        except (BakeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _finish(self):
        try:
            self.bake.finish(self._warn)
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{self.bake.output}: lit")
        return {"FINISHED"}

    def execute(self, context):
        """Waits for the program: scripts, and Blender without a window."""
        if not self._begin(context):
            return {"CANCELLED"}
        self.bake.job.wait()
        return self._finish()

    def invoke(self, context, event):
        if context.window_manager.vdb_diffuse_progress >= 0:
            self.report({"ERROR"}, "a bake is running already: wait for it, or cancel it with Esc")
            return {"CANCELLED"}
        if not self._begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, 100)
        manager.vdb_diffuse_progress = 0
        self.timer = manager.event_timer_add(TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            self.bake.job.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.bake.job.running():
            self._show(context)
            return {"PASS_THROUGH"}
        self._end(context)
        if self.bake.job.cancelled:
            self.bake.drop()
            self.report({"INFO"}, "Bake cancelled")
            return {"CANCELLED"}
        return self._finish()

    def _show(self, context):
        fraction, phase = self.bake.job.progress()
        context.window_manager.vdb_diffuse_progress = 100 * fraction
        context.window_manager.progress_update(100 * fraction)
        context.workspace.status_text_set(f"Baking light: {phase}, {100 * fraction:.0f} %   (Esc cancels)")
        for area in context.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()

    def _end(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        context.window_manager.vdb_diffuse_progress = -1
        context.workspace.status_text_set(None)

    def cancel(self, context):
        """Blender closes, or opens another file."""
        self.bake.job.cancel()
        self.bake.job.wait()
        self._end(context)
        self.bake.drop()


class VDB_DIFFUSE_OT_restore(bpy.types.Operator):
    """Give the volume its own file and material back. The lit file stays on disk"""

    bl_idname = "vdb_diffuse.restore"
    bl_label = "Remove Baked Lighting"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        item = context.object
        return item is not None and item.type == "VOLUME" and bool(item.data.vdb_diffuse.source)

    def execute(self, context):
        volume, settings = context.object.data, context.object.data.vdb_diffuse
        volume.filepath, volume.render.clipping = settings.source, settings.source_clipping
        if _materialOf(context.object) is settings.baked_material:
            _assign(context.object, settings.source_material)
        settings.source = settings.baked_file = ""
        settings.source_material = None
        return {"FINISHED"}


CLASSES = (VDB_DIFFUSE_OT_bake, VDB_DIFFUSE_OT_restore)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
