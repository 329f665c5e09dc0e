"""What to set where odometry is in another frame than the workspace."""


def remedy_for_frame(frame: str) -> str:
    """Return the end of a refusal: what to set if a frame is right; the controller follows."""
    if not frame:
        return ''
    return f'; if that is the right one, start learner_node with frame_id:={frame}'
