"""The add-on in a window, bake button and Esc included; leaves a picture of its panel.

    xvfb-run -a -s '-screen 0 1800x1500x24' blender -p 0 0 1800 1500 --factory-startup -noaudio \\
      --enable-event-simulate -P tests/blender/window.py -- PANEL.png

with BLENDER_USER_SCRIPTS set to an empty folder. Run by hand: it needs xvfb, and draws in software.
"""

import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bpy
import stage

PICTURE = os.path.abspath(sys.argv[sys.argv.index("--") + 1])


def context():
    """A window's context, with the properties editor on the object's data."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "PROPERTIES")
    return {"window": window, "screen": window.screen, "area": area, "region": area.regions[-1],
            "object": bpy.data.objects["cloud"], "scene": window.scene}


def press(key):
    window = bpy.context.window_manager.windows[0]
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type=key, value=value, x=10, y=10)


def start(**settings):
    for name, value in settings.items():
        setattr(bpy.data.objects["cloud"].data.vdb_diffuse, name, value)
    with bpy.context.temp_override(**context()):
        assert bpy.ops.vdb_diffuse.bake("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def running():
    return bpy.context.window_manager.vdb_diffuse_progress >= 0


def picture(path):
    with bpy.context.temp_override(**context()):
        bpy.ops.screen.screenshot(filepath=path)


def steps():
    """What happens, one after another; each yield lets Blender live for that many seconds."""
    volume = bpy.data.objects["cloud"].data
    source = volume.filepath
    yield 1.0
    start(sweeps=60)
    seen = 0
    while running() and seen < 30:
        seen = max(seen, bpy.context.window_manager.vdb_diffuse_progress)
        yield 0.2
    assert seen >= 30, f"the progress stopped at {seen}"
    picture(PICTURE.replace(".png", "_running.png"))
    press("ESC")
    for _ in range(100):  # windows drawn in software take seconds to see a key
        if running():
            yield 0.2
    volume = bpy.data.objects["cloud"].data
    assert not running(), "Esc did not cancel"
    assert volume.filepath == source, volume.filepath
    print("cancelled by Esc")

    start(sweeps=2)
    while running():
        yield 0.2
    assert volume.filepath.endswith("cumulus_lit.vdb"), volume.filepath
    print("baked")
    space = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D").spaces[0]
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "RENDERED"
    space.overlay.show_overlays = space.show_gizmo = False
    yield 20.0
    picture(PICTURE)


def prepare():
    bpy.context.preferences.view.show_splash = False  # it would take the Esc
    stage.installAddon()
    stage.emptyScene(16)
    stage.addVolume(shutil.copy(stage.data("cumulus.vdb"), stage.FOLDER))
    stage.addLamp("SUN", 4, direction=(0.5, 0.3, -0.8))
    stage.addWorld((0.15, 0.2, 0.3))
    stage.addCamera()
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "PROPERTIES":
            area.spaces[0].context = "DATA"


def run():
    try:
        return next(STEPS)
    except StopIteration:
        print("window: passed")
        os._exit(0)
    except BaseException as error:
        print(f"window: FAILED: {error!r}")
        os._exit(1)


prepare()
STEPS = steps()
bpy.app.timers.register(run, first_interval=2.0)
