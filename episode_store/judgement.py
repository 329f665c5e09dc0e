"""What a person says of a bag, beside what was said of it while it was recorded."""

from pathlib import Path

from episode_store.episode import find_topic, last_of_demonstration, read_header
from episode_store.label import write_label
from episode_store.rosbag2.errors import mcap_path, NothingToLearnError
from episode_store.rosbag2.reader import BagReader, RawMessages
from episode_store.rosbag2.topic_tables import decision_table
from episode_store.task_folder import EpisodeKind
from episode_store.trials import own_trial
from msgs_bridge.messages.trial_status import Label, TrialStatus


def judge_bag(folder: Path | str, label: Label) -> None:
    """
    Keep what a person says of a bag; nothing that was recorded is changed.

    Parameters
    ----------
    folder : Path
        The bag's folder, whose recording was closed.
    label : Label
        `Label.NONE` takes back what was said. Unless that was said while it was recorded, the
        folder is then, byte by byte, as it was before anything was said.

    Raises
    ------
    BagError
        If the bag cannot be read or the label not be written, or the bag was not closed.

    """
    is_as_recorded = label is Label.NONE and recorded_label(folder) is Label.NONE
    write_label(folder, None if is_as_recorded else label)


def recorded_label(folder: Path | str) -> Label:
    """
    Return what a person said of a bag while it was recorded.

    Raises
    ------
    BagError
        If it cannot be read, or is none of ours.

    """
    status = recorded_status(folder)
    return Label.NONE if status is None else status.label


def recorded_status(folder: Path | str) -> TrialStatus | None:
    """
    Return how a bag says that it ended; None if it does not.

    Raises
    ------
    BagError
        If it cannot be read, or is none of ours.

    """
    path = Path(folder)
    try:
        header = read_header(path)
    except NothingToLearnError:
        return None
    bag = BagReader(mcap_path(path))

    def messages(role: str) -> RawMessages:
        return bag.messages(find_topic(bag.topics, role, header.topics))

    if header.kind is EpisodeKind.DEMO:
        return last_of_demonstration(messages('trial'))
    rows = decision_table(messages('experience'), header.grid)[0]
    return own_trial(messages('trial'), rows)[1]
