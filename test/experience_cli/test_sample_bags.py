"""The committed bags: other people's readers open them, and they teach what they always did."""

import warnings

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores

from bridge_helpers import content_of
from control_field.records import Demonstration, Outcome
from episode_store.episode import Episode
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import TaskFolder
from experience_cli.arguments import parser
from experience_cli.main import main
from msgs_bridge.messages.tables import decisions_from_cloud, field_from_cloud
from sample_helpers import BAGS
from tools.record_sample_bags import digest_of

TASK = TaskFolder(BAGS, 'sample')
EPISODES = TASK.episodes()


def test_there_is_a_demonstration_and_two_trials_below_a_megabyte():
    assert [episode.path.name for episode in EPISODES] == ['0001_demo', '0002_trial', '0003_trial']
    assert sum(path.stat().st_size for path in BAGS.rglob('*') if path.is_file()) < 1_000_000
    demo, first, second = (content_of(episode.path) for episode in EPISODES)
    assert isinstance(demo.record, Demonstration)
    assert len(demo.record.cells) == 16
    assert [trial.record.outcome for trial in (first, second)] == [Outcome.GOAL] * 2
    assert first.record.n_online_reinforcements > 0 == second.record.n_online_reinforcements


def test_they_teach_what_they_always_did():
    written = (BAGS / 'sample.sha256').read_text().strip()
    assert digest_of(TASK) == written, (
        'the sample bags teach another field than before. If the learner was changed on purpose, '
        'write down what they teach now with `python -m tools.record_sample_bags --digest-only` '
        'and say so in CHANGELOG.rst; otherwise equal bags no longer give equal bytes')


def test_learn_prints_the_same_digest(capsys):
    assert main(['learn', str(TASK.path), '--quiet']) == 0
    assert digest_of(TASK) in capsys.readouterr().out


@pytest.mark.parametrize('episode', EPISODES, ids=lambda episode: episode.path.name)
def test_rosbags_reads_every_message(episode):
    ours = BagReader(episode.bag)
    counts = dict.fromkeys(ours.topics, 0)
    with AnyReader([episode.path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            assert message.__msgtype__ == connection.msgtype == ours.topics[connection.topic]
            counts[connection.topic] += 1
    assert counts == {topic: len(ours.messages(topic)) for topic in ours.topics}
    assert Episode(episode).is_closed


@pytest.mark.parametrize('episode', EPISODES[1:], ids=lambda episode: episode.path.name)
def test_mcap_ros2_support_reads_the_very_field_and_decisions(episode):
    field = Episode(episode).field()
    decisions, odometry = [], []
    with episode.bag.open('rb') as file, warnings.catch_warnings():
        warnings.simplefilter('ignore')
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for found in reader.iter_decoded_messages():
            if found.channel.topic == '/control_field':
                recorded = field_from_cloud(found.decoded_message)
                assert (recorded.vx == field.vx).all()
                assert (recorded.q == field.q).all()
                assert (recorded.goal, recorded.revision) == (field.goal, episode.number - 1)
            elif found.channel.topic == '/experience':
                decisions += decisions_from_cloud(found.decoded_message, field.grid).tolist()
            elif found.channel.topic == '/odom':
                odometry.append(found.decoded_message.pose.pose.position.x)
    assert decisions == content_of(episode.path).record.decisions.tolist()
    assert len(odometry) == len(BagReader(episode.bag).messages('/odom'))


def test_the_readme_names_commands_that_there_are():
    lines = [line.partition('#')[0].split() for line in (BAGS / 'README.md').read_text(
        ).splitlines() if line.startswith('experience ')]
    assert len(lines) >= 5
    for words in lines:
        parser().parse_args(words[1:])
