"""Bags of drives that no robot has driven: refused or cut, in the same words everywhere."""

from dataclasses import replace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from bridge_helpers import (
    CLOUD, content_of, GRID, nanoseconds, OCCUPANCY, ODOMETRY, raw_decisions, raw_local_grid,
    raw_odometry, raw_status, STATUS)
from control_field.headings import heading_from_step
from control_field.parameters import Parameters
from control_field.records import ControlField, DECISION_DTYPE, Kind, Outcome
from control_field.robot.policy import TrialPolicy
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError, OutsideDriveError
from episode_store.external.import_drive import check_drive
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import Relearner
from episode_store.rosbag2.errors import BagError
from episode_store.summary import summary_of
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from external_bags import external_demonstration, STORE
from msgs_bridge.messages.serialized import cdr_from_message
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.messages.trial_status import State

STAMPS = 100.0 + np.arange(300) / 20.0
WAY = np.stack([0.6 + 0.01 * np.arange(300), 0.6 + 0.005 * np.arange(300)], axis=1)


def whole(stamps, xy):
    return stamps, xy


def reset(stamps, xy):
    return stamps, np.concatenate([xy[:150], xy[150:] - xy[150] + 0.1])


def seconds_missing(stamps, xy):
    left = np.r_[0:100, 180:300]
    return stamps[left], xy[left]


def spike(stamps, xy):
    xy[120] = 4.4, 0.3
    return stamps, xy


def two_sources(stamps, xy):
    xy[1::2] = 4.0, 0.5
    return stamps, xy


def out_and_back(stamps, xy):
    xy[:, 1] -= 2.0 * np.sin(np.linspace(0.0, np.pi, 300))
    return stamps, xy


BROKEN = {reset: 'at 7.50 s the pose leaps', seconds_missing: 'no pose has come between 4.95 and '
          '9.00 s', two_sources: 'two sources speak in turns', out_and_back: 'lie outside, the'}


def own_bag(root, change, speed_max=3.0):
    header = EpisodeHeader('demo', 'task1', GRID, speed_max=speed_max).to_mapping()
    with start_bag(TaskFolder(root, 'task1'), 'demo', header) as bag:
        for stamp, (x, y) in zip(*change(STAMPS.copy(), WAY.copy()), strict=True):
            bag.write('/odom', ODOMETRY, raw_odometry(stamp, x, y), nanoseconds(stamp))
    return bag.folder


def external_bag(path, change):
    with Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        odom = writer.add_connection('/odom', ODOMETRY, typestore=STORE)
        for stamp, (x, y) in zip(*change(STAMPS.copy(), WAY.copy()), strict=True):
            writer.write(odom, nanoseconds(stamp), raw_odometry(stamp, x, y))
    return path


@pytest.mark.parametrize('change', BROKEN, ids=lambda change: change.__name__)
def test_a_broken_drive_is_refused_whoever_recorded_it(tmp_path, change):
    said = BROKEN[change]
    folder, theirs = own_bag(tmp_path, change), external_bag(tmp_path / 'bag', change)
    with pytest.raises(NothingToLearnError, match=said):
        content_of(folder)
    for read in (lambda: external_demonstration(theirs, GRID),
                 lambda: check_drive(theirs, GRID, {})):
        with pytest.raises(BagError, match=said):
            read()


@pytest.mark.parametrize('change', BROKEN, ids=lambda change: change.__name__)
def test_the_learner_says_it_and_its_field_stays(tmp_path, change):
    relearner = Relearner(GRID, Parameters())
    relearner.learn(Episode.at(own_bag(tmp_path, whole)))
    before = relearner.field()
    learnt_bag = relearner.learn(Episode.at(own_bag(tmp_path, change)))
    assert learnt_bag.refresh is None
    assert learnt_bag.note.startswith('nothing was learnt: ')
    assert BROKEN[change] in learnt_bag.note
    assert relearner.field() is before


def test_what_lies_on_one_side_of_a_break_can_be_kept_by_a_person(tmp_path):
    with pytest.raises(NothingToLearnError, match=(
            r'`experience trim task1/0001 --to 7.45`\) or after it \(--from 7.50\)')):
        content_of(own_bag(tmp_path, reset))


def test_a_spike_is_left_out_and_nothing_is_remembered_of_it(tmp_path):
    relearner = Relearner(GRID, Parameters())
    learnt_bag = relearner.learn(Episode.at(own_bag(tmp_path, spike)))
    assert ('1 pose is far off the others at 6.00 s, at (4.40, 0.30), and is left out'
            in learnt_bag.note)
    cells = {tuple(cell) for cell in learnt_bag.content.record.cells.tolist()}
    assert cells <= {tuple(cell) for cell in GRID.cells_from_world(WAY).tolist()}
    assert learnt_bag.content.report.n_filled == 0
    assert relearner.field().known[GRID.cell_from_world(4.4, 0.3)] == -1


def test_what_was_seen_from_where_the_robot_was_not_is_not_remembered(tmp_path):
    header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
    all_blocked = np.full((3, 3), 100)
    with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', header) as bag:
        for i, (stamp, (x, y)) in enumerate(zip(*spike(STAMPS.copy(), WAY.copy()), strict=True)):
            bag.write('/odom', ODOMETRY, raw_odometry(stamp, x, y), nanoseconds(stamp))
            if i % 10:  # so that a cell is entered while that of the spike is the newest
                continue
            at = GRID.cell_from_world(x, y)
            bag.write('/neighbourhood', OCCUPANCY, raw_local_grid(
                stamp, *at, all_blocked if x > 4.0 else np.zeros((3, 3))), nanoseconds(stamp))
    episode = content_of(bag.folder)
    assert '6.00 s' in str(episode.report)
    assert not episode.record.blocked.any()
    assert not episode.record.unknown.any()


def test_a_broken_bag_shows_evaluate_nothing(tmp_path, capsys):
    theirs = external_bag(tmp_path / 'bag', reset)
    assert main(['evaluate', '--world', 'open', '--demo-bag', str(theirs), '--trials', '0']) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert 'at 7.50 s the pose leaps' in line


def test_the_part_that_a_person_keeps_is_learnt(tmp_path, capsys):
    own_bag(tmp_path, reset)
    assert main(['trim', '--bags', str(tmp_path), 'task1/0001', '--to', '7.45']) == 0
    assert 'robot gets to the goal' in capsys.readouterr().out
    cells = content_of(tmp_path / 'task1' / '0001_demo').record.cells
    assert tuple(cells[-1].tolist()) == GRID.cell_from_world(*WAY[149])


def test_the_workspace_that_is_named_holds_the_drive(tmp_path):
    theirs = external_bag(tmp_path / 'bag', out_and_back)
    with pytest.raises(OutsideDriveError) as caught:
        external_demonstration(theirs, GRID)
    assert len(external_demonstration(theirs, caught.value.fitting)[0].cells) > 10
    with pytest.raises(NothingToLearnError, match='or let it fit itself'):
        content_of(own_bag(tmp_path, out_and_back))


def forged_trials(root, n, topics, decides):
    """Record trials that somebody made up while the robot stood, or drove elsewhere."""
    header = EpisodeHeader('trial', 'task1', GRID, topics=topics).to_mapping()
    for number in range(1, n + 1):
        rows = np.zeros(4, DECISION_DTYPE)
        rows['stamp'], rows['trial'] = 100.5 + np.arange(4), number
        rows['row'] = rows['next_row'] = 2
        rows['col'] = decides + np.arange(4)
        rows['next_col'] = rows['col'] + 1
        with start_bag(TaskFolder(root, 'task1'), 'trial', header) as bag:
            bag.write('/trial', STATUS, raw_status(State.RUNNING, number), 0)
            bag.write('/experience', CLOUD, raw_decisions(rows), 1)
            for i in range(120 if topics else 0):
                bag.write('/odom', ODOMETRY, raw_odometry(100.0 + i / 20.0, 0.6, 0.6), i)
            bag.write('/trial', STATUS, raw_status(
                State.ENDED, number, Outcome.COLLISION, decisions=4, stamp=105.0), 999)
        yield bag.folder


@pytest.mark.parametrize('decides', [2, 9], ids=['from where it is', 'from elsewhere'])
def test_trials_that_were_made_up_teach_nothing_and_count_for_nothing(tmp_path, decides):
    relearner = Relearner(GRID, Parameters())
    relearner.learn(Episode.at(own_bag(tmp_path, whole)))
    before = relearner.field()
    for folder in forged_trials(tmp_path, 5, {'odom': '/odom'}, decides):
        learnt = relearner.learn(Episode.at(folder))
        assert learnt.refresh is None
        assert 'nothing was learnt: its decisions do not fit where the robot was' in learnt.note
        summary = summary_of(Episode.at(folder))
        assert summary.state == 'not kept'
        assert 'do not fit where the robot was' in summary.note
    assert relearner.field() is before
    assert relearner.n_trials == 0


@pytest.mark.parametrize(('stamp', 'ends', 'is_doubted'), [
    (0.0, 5, False), (103.5, 3, True), (104.5, 6, False)], ids=['no stamp', 'not there', 'there'])
def test_a_trial_that_was_driven_is_learnt_and_a_goal_was_reached(
    tmp_path, stamp, ends, is_doubted,
):
    rows = np.zeros(4, DECISION_DTYPE)
    rows['stamp'], rows['trial'], rows['row'], rows['next_row'] = 100.0 + np.arange(4), 1, 2, 2
    rows['col'], rows['next_col'] = np.arange(2, 6), np.arange(3, 7)
    header = EpisodeHeader('trial', 'task1', GRID, topics={'odom': '/odom'}).to_mapping()
    with start_bag(TaskFolder(tmp_path, 'task1'), 'trial', header) as bag:
        bag.write('/trial', STATUS, raw_status(State.RUNNING, 1), 0)
        bag.write('/experience', CLOUD, raw_decisions(rows), 1)
        for i in range(91):
            x = min(0.625 + 0.0125 * i, GRID.world_from_cell(2, ends)[0])
            bag.write('/odom', ODOMETRY, raw_odometry(100.0 + i / 20.0, x, 0.6), i)
        bag.write('/trial', STATUS, raw_status(
            State.ENDED, 1, Outcome.GOAL, decisions=4, stamp=stamp), 999)
    episode = content_of(bag.folder)
    assert bool(episode.doubt) is is_doubted
    assert episode.record.outcome is (Outcome.ABORTED if is_doubted else Outcome.GOAL)


MEMORY = 'task1:0123456789abcdef'


def driven_trial(root, rows, ends, *, memory=MEMORY):
    """Record a drive from cell (2, 2) to (2, 6), with decisions that may not all be its own."""
    header = EpisodeHeader('trial', 'task1', GRID, topics={'odom': '/odom'},
                           memory=memory).to_mapping()
    field = replace(ControlField.void(GRID), goal=(2, 6), memory=memory)
    with start_bag(TaskFolder(root, 'task1'), 'trial', header) as bag:
        bag.write('/control_field', CLOUD, cdr_from_message(cloud_from_field(field)), 0)
        bag.write('/trial', STATUS, raw_status(State.RUNNING, 1, memory=memory), 0)
        for row in rows:
            bag.write('/experience', CLOUD, raw_decisions(np.array([row])), 1)
        for i in range(91):
            bag.write('/odom', ODOMETRY, raw_odometry(
                100.0 + i / 20.0, 0.625 + 0.0125 * i, 0.6), i)
        bag.write('/trial', STATUS, raw_status(
            State.ENDED, 1, **{'decisions': 4, 'stamp': 104.4, 'memory': memory, **ends}), 999)
    return content_of(bag.folder)


def decisions_of_the_drive():
    rows = np.zeros(4, DECISION_DTYPE)
    rows['stamp'], rows['trial'], rows['row'], rows['next_row'] = 100.0 + np.arange(4), 1, 2, 2
    rows['col'], rows['next_col'], rows['step'] = np.arange(2, 6), np.arange(3, 7), np.arange(4)
    return rows


def test_the_decisions_of_a_drive_are_believed(tmp_path):
    episode = driven_trial(tmp_path, decisions_of_the_drive(), {'outcome': Outcome.GOAL})
    assert (episode.doubt, episode.record.outcome) == ('', Outcome.GOAL)


def test_so_are_those_of_a_drive_that_a_person_took_over(tmp_path):
    policy = TrialPolicy(replace(ControlField.void(GRID), goal=(2, 6)), Parameters(),
                         np.random.default_rng(0), 1)
    east = heading_from_step(0, 1)
    rows = []
    for col, stamp in zip(range(2, 6), 100.0 + np.arange(4), strict=True):
        if col in (3, 4):
            rows.extend(policy.taught(2, col, east, 0, 0, stamp))
        else:
            rows.extend(policy.decide(2, col, 0, 0, stamp).decisions)
            rows[-1]['action'], rows[-1]['next_row'], rows[-1]['next_col'] = east, 2, col + 1
    assert driven_trial(tmp_path, rows, {'outcome': Outcome.GOAL}).doubt == ''


@pytest.mark.parametrize(('place', 'change'), [
    (4, {}), (2, {'reward': -1}), (4, {'step': 9, 'reward': 1}), (4, {'kind': Kind.BLOCKED})])
def test_decisions_that_somebody_slips_into_a_trial_that_is_driven_are_doubted(
        tmp_path, place, change):
    rows = decisions_of_the_drive()
    forged = rows[place - 1:place].copy()
    for name, value in change.items():
        forged[name] = value
    episode = driven_trial(tmp_path, np.concatenate([rows[:place], forged, rows[place:]]),
                           {'outcome': Outcome.GOAL})
    assert '5 decisions came, and the controller made 4 of them' in episode.doubt
    assert episode.record.outcome is Outcome.ABORTED


def test_a_step_in_the_place_of_another_is_doubted(tmp_path):
    rows = decisions_of_the_drive()
    rows[2] = rows[1]
    assert 'step 1 comes after step 1' in driven_trial(
        tmp_path, rows, {'outcome': Outcome.GOAL}).doubt


@pytest.mark.parametrize(('n_rows', 'is_doubted'), [(4, False), (3, False), (2, True)])
def test_a_goal_is_where_the_field_leads_to_whatever_trial_says(tmp_path, n_rows, is_doubted):
    episode = driven_trial(tmp_path, decisions_of_the_drive()[:n_rows],
                           {'outcome': Outcome.GOAL, 'stamp': 0.0})
    assert ('is said to have reached the goal at' in episode.doubt) is is_doubted


def test_a_bag_that_does_not_say_by_whose_field_it_was_driven_is_read_as_ever(tmp_path):
    rows = decisions_of_the_drive()[[0, 1, 1, 2, 3]]
    assert driven_trial(tmp_path, rows, {'outcome': Outcome.GOAL}, memory='').doubt == ''


def test_a_trial_whose_odometry_nobody_heard_is_not_learnt(tmp_path):
    [folder] = forged_trials(tmp_path, 1, {'odom': '/elsewhere/odom'}, 2)
    assert 'no odometry was recorded with it' in content_of(folder).doubt


def test_how_fast_the_robot_is_stands_in_the_bag(tmp_path):
    content_of(own_bag(tmp_path, whole))
    with pytest.raises(NothingToLearnError, match=r'it drives .* gets .* m at most'):
        content_of(own_bag(tmp_path, whole, speed_max=0.05))


def written(path, frames):
    """Record the whole drive; the frame of each pose is ``frames(i)``, None for no number."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        odom = writer.add_connection('/odom', ODOMETRY, typestore=STORE)
        for i, (stamp, (x, y)) in enumerate(zip(STAMPS.tolist(), WAY.tolist(), strict=True)):
            message = raw_odometry(stamp, x if frames(i) else np.nan, y, frames(i) or 'odom')
            writer.write(odom, nanoseconds(stamp), message)
    return path


@pytest.mark.parametrize('other', ['map', None])
def test_a_drive_that_goes_on_in_another_frame_has_no_goal(tmp_path, capsys, other):
    path = written(tmp_path / 'theirs', lambda i: 'odom' if i < 150 else other)
    with pytest.raises(BagError, match=r'where this drive ends: its last 150 messages \(7\.5 s\)'):
        external_demonstration(path, GRID)
    assert main(['learn', str(path), '--into', str(tmp_path / 'bags' / 'task')]) == 2
    error = capsys.readouterr().err
    assert 'are refused, such as: /odom: ' in error
    assert '--frame' not in error
    path = written(tmp_path / 'began', lambda i: other if i < 150 else 'odom')
    with pytest.raises(BagError, match=r'where this drive begins: its first 150 messages'):
        external_demonstration(path, GRID)


@pytest.mark.parametrize('frames', [
    lambda i: 'map' if i % 3 == 0 else 'odom', lambda i: None if i < 3 or i > 297 else 'odom'],
    ids=['another node says the same in its frame', 'none at the very ends'])
def test_messages_in_between_that_are_no_poses_are_left_out_and_said(tmp_path, frames):
    record, _, [note] = external_demonstration(written(tmp_path / 'theirs', frames), GRID)
    assert GRID.cells_from_world(WAY[[3, -5]]).tolist() == record.cells[[0, -1]].tolist()
    assert 'messages refused, the first: /odom: ' in note
