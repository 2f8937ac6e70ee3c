"""Names that reach into model instances: `arm::gripper::finger`."""

from sheldrake.common._checked import checked


@checked
def GetScopedFrameByName(plant, full_name: str):
    """The frame of a possibly scoped name.

    Raises:
        RuntimeError: When there is none; the message lists the frames of the model instance meant.
    """
    frame = GetScopedFrameByNameMaybe(plant, full_name)
    if frame is None:
        scope, _, local = full_name.rpartition("::")
        if scope and not plant.HasModelInstanceNamed(scope):
            raise RuntimeError(f"GetScopedFrameByName(): '{full_name}': there is no model instance '{scope}'.")
        owner = f" in model instance '{scope}'" if scope else ""
        known = ", ".join(_frame_names(plant, scope)) or "(none)"
        raise RuntimeError(f"GetScopedFrameByName(): there is no frame '{local}'{owner}; its frames are {known}.")
    return frame


@checked
def GetScopedFrameByNameMaybe(plant, full_name: str):
    """The frame of a possibly scoped name, or None.

    Raises:
        RuntimeError: When a name without scope stands for frames of several model instances.
    """
    scope, separator, local = full_name.rpartition("::")
    if not separator:
        return plant.GetFrameByName(full_name) if plant.HasFrameNamed(full_name) else None
    if not plant.HasModelInstanceNamed(scope):
        return None
    instance = plant.GetModelInstanceByName(scope)
    return plant.GetFrameByName(local, instance) if plant.HasFrameNamed(local, instance) else None


def _frame_names(plant, scope: str) -> "list[str]":
    from sheldrake.multibody.tree import FrameIndex

    wanted = plant.GetModelInstanceByName(scope) if scope else None
    frames = [plant.get_frame(FrameIndex(index)) for index in range(plant.num_frames())]
    return [frame.name() for frame in frames if wanted is None or frame.model_instance() == wanted]


def join_names(scope: str, name: str) -> str:
    """`scope::name`, or the name alone when there is no scope."""
    return f"{scope}::{name}" if scope else name
