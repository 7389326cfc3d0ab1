class BakeError(Exception):
    """What the user has to know: what is wrong, where, and what to do. Shown in Blender's interface."""
