"""`experience explain`: what it shows adds up, and comes from where it says."""

from dataclasses import replace
from itertools import pairwise
import json
import math

from geometry_msgs.msg import TwistStamped
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from bridge_helpers import content_of, demonstration_bag
from control_field.compass import COMPASS
from control_field.headings import UNIT
from control_field.learning.provenance import TOLERANCE
from control_field.records import Kind
from control_field.robot.limits import Limits
from episode_store.episode import Episode
from episode_store.explanation import Moment
from episode_store.relearn import relearn
from experience_cli.main import main
from msgs_bridge.messages.tables import cloud_from_field, cloud_from_prototypes
from sample_helpers import DEMO, FIRST, rewritten, SECOND


@pytest.fixture
def explain(capsys):
    """Explain a moment; return the JSON object, or the text."""
    def call(bag, at, *more, code=0):
        assert main(['explain', bag, '--at', str(at), *(more or ('--json',))]) == code
        out = capsys.readouterr().out
        return out if more else json.loads(out)

    return call


def unit(name):
    return UNIT[COMPASS.index(name)]


@pytest.mark.parametrize('number', [2, 3])
def test_the_shares_reproduce_the_fields_vector_at_every_decision(task, explain, number):
    episode = task.find(number)
    start, field = Episode(episode).start, Episode(episode).field()
    rows = content_of(episode.path).record.decisions
    for row in rows[rows['kind'] != Kind.BLOCKED]:
        shown = explain(f'sample/{number}', max(float(row['stamp']) - start, 0.0))
        heading, cell = shown['course'], (int(row['row']), int(row['col']))
        assert tuple(shown['cell']) == cell
        total = sum((voice['share'] * unit(voice['heading'])
                     for voice in heading['prototypes']), np.zeros(2))
        if heading['pull']:
            total = total + heading['pull']['share'] * unit(heading['pull']['heading'])
        expected = field.coherence[cell] * np.array([field.vx[cell], field.vy[cell]])
        np.testing.assert_allclose(total, expected, atol=TOLERANCE)
        np.testing.assert_allclose(heading['vector'], expected, atol=TOLERANCE)
        assert heading['adds_up']
        assert heading['source'] == 'recorded'
        assert [heading['q'][name] for name in COMPASS] == field.q[cell].tolist()
        decided = shown['decision'][-1]
        assert decided['heading'] == COMPASS[int(row['action'])]
        assert decided['kind'] == Kind(int(row['kind'])).name.lower()


def test_a_prototype_is_traced_to_the_second_it_was_shown(task, explain):
    shown = explain(FIRST, 1.0)
    [voice] = shown['course']['prototypes']
    demo = Episode(task.find(1))
    at = int(np.searchsorted(demo.poses.stamps - demo.start, voice['second'] - 1e-6))
    cell = demo.header.grid.cell_from_world(*demo.poses.xyyaw[at, :2].tolist())
    assert (voice['share'], voice['episode'], voice['demonstrated']) == (1.0, 1, True)
    assert list(cell) == voice['cell'] == shown['cell']
    assert 'sample/0001 at ' in explain(FIRST, 1.0, '--bags', 'bags')


def test_a_refused_heading_is_told_with_what_was_done_instead(task, explain):
    rows = content_of(task.find(2).path).record.decisions
    refused = rows[rows['kind'] == Kind.BLOCKED][0]
    shown = explain(FIRST, float(refused['stamp']) - Episode(task.find(2)).start)
    assert [row['kind'] for row in shown['decision']] == ['blocked', 'avoid']
    assert [row['reward'] for row in shown['decision']] == [-1, 1]
    assert shown['decision'][0]['heading'] in shown['decision'][0]['sight_blocked']
    text = explain(FIRST, shown['at'], '--bags', 'bags')
    assert 'was refused: the local grid showed it blocked' in text
    assert 'by the Q-matrix' in text
    assert "which is the field's vector" in text


def test_the_command_is_the_one_that_answered_the_odometry(task, explain):
    recording = Episode(task.find(3))
    for i in (5, 60, 150):
        at = float(recording.poses.stamps[i]) - recording.start
        shown = explain(SECOND, at + 0.01)
        assert shown['stamp'] == recording.poses.stamps[i]
        assert shown['pose'] == recording.poses.xyyaw[i].tolist()
        v, w = shown['command']['applied']
        assert abs(v) <= 0.22
        assert math.isfinite(w)
        assert shown['command']['requested'] is None


def test_the_limits_that_a_command_reaches_are_named(task, explain):
    assert explain(SECOND, 0.0)['command']['at_limits'] == ['speed']
    cruising = explain(SECOND, 3.0)['command']
    assert (cruising['applied'][0], cruising['at_limits']) == (0.22, ['speed'])
    text = explain(SECOND, 3.0, '--bags', 'bags')
    assert 'no less than a TurtleBot3 Burger can: speed' in text
    text = explain(SECOND, 3.0, '--v-max', '0.26')
    assert 'can:' not in text
    stamps = Episode(task.find(3)).poses.stamps
    commands = [explain(SECOND, stamp - stamps[0])['command'] for stamp in stamps[30:45].tolist()]
    for before, now in pairwise(commands):
        ramped = abs(abs(now['applied'][1] - before['applied'][1]) - 3.2 * 0.1) < 1e-6
        assert ramped == ('turning acceleration' in now['at_limits'])
    assert any('turning acceleration' in command['at_limits'] for command in commands)


def test_a_moment_may_be_named_by_its_stamp(task, explain):
    recording = Episode(task.find(2))
    stamp = recording.start + recording.duration - 0.05
    assert explain(FIRST, stamp) == explain(FIRST, recording.duration - 0.05)


def test_in_the_first_demonstration_a_person_drove_and_there_was_no_field(task, explain):
    shown = explain(DEMO, 3.0)
    assert (shown['course'], shown['decision']) == (None, [])
    text = explain(DEMO, 3.0, '--bags', 'bags')
    assert 'a person drove' in text
    assert 'there was no field yet' in text


def test_a_bag_that_holds_no_field_is_not_said_to_be_from_before_there_was_one(task, explain):
    theirs = demonstration_bag(task.root / 'theirs')
    assert main(['learn', str(theirs), '--odom-topic', '/odom', '--into', str(task.path)]) == 0
    text = explain('sample/0004', 3.0, '--bags', 'bags')
    assert 'the bag holds no field: it was taken over from 0001_demo' in text
    assert 'no field yet' not in text
    bare = rewritten(task, 3, lambda topic, *rest: [] if topic == '/control_field' else [
        (topic, *rest)])
    assert 'the bag holds no field: which' in explain(bare.name, 3.0)['no_course']


def test_without_recorded_prototypes_they_are_relearnt(task, explain):
    refresh = relearn(task.episodes()[:2])[0].refresh
    field = serialize_message(cloud_from_field(refresh.field))
    prototypes = serialize_message(cloud_from_prototypes(refresh.prototypes, refresh.field.grid))
    asked = []
    for kept in (prototypes, None):
        def change(topic, type_name, message, kept=kept):
            new = {'/control_field': field, '/prototypes': kept}.get(topic, message)
            return [] if new is None else [(topic, type_name, new)]

        episode = rewritten(task, 3, change)
        asked.append(explain(episode.name, 6.0)['course'])
        task.forget(episode.number)
    assert [heading.pop('source') for heading in asked] == ['recorded', 'relearnt']
    assert asked[0] == asked[1]
    assert asked[0]['adds_up']
    assert asked[0]['prototypes']


def test_prototypes_that_do_not_add_up_are_not_passed_off_as_the_reason(task, explain):
    refresh = relearn(task.episodes())[0].refresh
    start = content_of(task.find(1).path).record.cells[:4]

    def change(topic, type_name, message):
        if topic == '/prototypes':
            kept = ~(refresh.prototypes.cells[:, None] == start).all(axis=2).any(axis=1)
            table = cloud_from_prototypes(type(refresh.prototypes)(**{
                name: getattr(refresh.prototypes, name)[kept] for name in (
                    'cells', 'headings', 'q', 'episodes', 'stamps', 'demonstrated')}),
                refresh.field.grid)
            message = serialize_message(table)
        return [(topic, type_name, message)]

    episode = rewritten(task, 3, change)
    for number in (1, 2, 3):
        task.forget(number)
    shown = explain(episode.name, 1.0, code=1)
    assert (shown['course']['adds_up'], shown['course']['prototypes']) == (False, [])
    assert 'do not make up this vector' in explain(episode.name, 1.0, '--bags', 'bags', code=1)


def test_a_curious_trial_is_told_from_one_that_follows_the_prototypes(task, explain):
    relearner, _ = relearn(task.episodes()[:2])
    field = serialize_message(cloud_from_field(relearner.field(exploring=True)))

    def change(topic, type_name, message):
        return [(topic, type_name, field if topic == '/control_field' else message)]

    episode = rewritten(task, 3, change)
    task.forget(3)
    shown = explain(episode.name, 6.0)
    assert (shown['course']['source'], shown['course']['prototypes']) == ('curious', [])
    assert 'to look around' in explain(episode.name, 6.0, '--bags', 'bags')


def test_a_doubted_wall_ahead_is_called_so(task, explain):
    refresh = relearn(task.episodes()[:2])[0].refresh
    assert explain(SECOND, 3.0)['course']['known_ahead'] in (-1, 0)
    field = replace(refresh.field, known=np.full_like(refresh.field.known, 40))
    messages = {'/control_field': serialize_message(cloud_from_field(field)), '/prototypes':
                serialize_message(cloud_from_prototypes(refresh.prototypes, field.grid))}
    episode = rewritten(task, 3, lambda topic, type_name, message: [
        (topic, type_name, messages.get(topic, message))])
    assert explain(episode.name, 3.0)['course']['known_ahead'] == 40
    said = 'in doubt by now (confidence 40 of 100)'
    assert said in explain(episode.name, 3.0, '--bags', 'bags')
    assert said not in explain(SECOND, 3.0, '--bags', 'bags')


def commanded(task, asked, applied):
    """Record the second trial anew: always the same command, and the same one asked for."""
    def change(topic, type_name, message):
        if topic == '/cmd_vel':
            return []
        if topic != '/odom':
            return [(topic, type_name, message)]
        sec, nanosec = np.frombuffer(message, '<i4', 2, 4).tolist()
        answers = []
        for name, (v, w) in (('/cmd_vel_requested', asked), ('/cmd_vel', applied)):
            twist = TwistStamped(header=Header())
            twist.header.stamp.sec, twist.header.stamp.nanosec = sec, nanosec
            twist.twist.linear.x, twist.twist.angular.z = v, w
            answers.append((name, 'geometry_msgs/msg/TwistStamped', serialize_message(twist)))
        return [(topic, type_name, message), *answers]

    return rewritten(task, 3, change)


@pytest.mark.parametrize(('asked', 'applied', 'rule'), [
    ((5.0, 0.0), (0.22, 0.0), 'speed'), ((math.nan, 0.0), (0.0, 0.0), 'not_finite')])
def test_what_the_monitor_did_to_a_request_is_named(task, explain, asked, applied, rule):
    episode = commanded(task, asked, applied)
    command = explain(episode.name, 3.0)['command']
    assert command['clipped_by'] == rule
    assert command['requested'] == [asked[0] if math.isfinite(asked[0]) else None, asked[1]]
    text = explain(episode.name, 3.0, '--bags', 'bags')
    assert f'was asked for, the collision monitor says: {rule} (for a TurtleBot3 Burger)' in text


def test_a_command_that_was_let_through_is_said_to_be_so(task, explain):
    episode = commanded(task, (0.2, 0.0), (0.2, 0.0))
    assert explain(episode.name, 3.0)['command']['clipped_by'] == 'none'
    assert '0.200 m/s, 0.000 rad/s, as it was asked for' in explain(
        episode.name, 3.0, '--bags', 'bags')


def test_what_a_burgers_limits_do_not_explain_is_not_passed_off_as_asked_for(task, explain):
    episode = commanded(task, (0.2, 0.0), (0.1, 0.0))
    recording, wide = Episode(episode), Limits(v_max=0.26, w_max=1.82, radius=0.22)
    at = next(at for at in np.arange(0.5, recording.duration, 0.1).tolist()
              if (seen := Moment(recording, at, wide).monitored).rule == 'slowed'
              and seen.reproduces and Moment(recording, at).monitored.rule == 'none')
    said = explain(episode.name, at)['command']
    assert said['clipped_by'] == 'unknown'
    assert said['gate'] == {'velocity': [0.2, 0.0], 'rule': 'none', 'reproduces': False}
    assert said['limits']['robot_radius'] == 0.105
    text = explain(episode.name, at, '--bags', 'bags')
    assert 'command: 0.100 m/s, 0.000 rad/s; 0.200 m/s, 0.000 rad/s was asked for' in text
    assert 'for a TurtleBot3 Burger at the recorded pose it would have let through 0.200' in text
    waffle = ('--v-max', '0.26', '--w-max', '1.82', '--robot-radius', '0.22')
    text = explain(episode.name, at, *waffle)
    assert ('the collision monitor says: slowed (for a robot with v_max 0.26, w_max 1.82, '
            'robot_radius 0.22)') in text
    text = explain(episode.name, at, '--footprint', '[[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1]]')
    assert 'robot with footprint [[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1]]' in text


@pytest.mark.parametrize(('option', 'value', 'what'), [
    ('--v-max', '0', 'v_max'), ('--w-max', 'nan', 'w_max'), ('--a-max', '1e-300', 'a_max'),
    ('--robot-radius', '-0.1', 'robot_radius')])
def test_a_limit_that_is_none_is_one_line(task, capsys, option, value, what):
    assert main(['explain', FIRST, '--at', '1', f'{option}={value}']) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith(f"experience explain: the robot's {what} is {float(value)}")


@pytest.mark.parametrize('at', ['-1', '500', 'nan', 'inf'])
def test_a_time_outside_the_bag_is_one_line(task, capsys, at):
    assert main(['explain', FIRST, '--at', at]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith('experience explain: --at ')
