"""metadata.yaml, against the one that rosbags writes."""

from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from ruamel.yaml import YAML

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.metadata import (
    BagSummary, known_qos, OfferedQos, read_yaml, TopicSummary, write_atomically, write_metadata)


def summary(*counts):
    return BagSummary('x_0.mcap', 5 * 10**18, 5 * 10**18 + 7, [
        TopicSummary(f'/t{i}', 'nav_msgs/msg/Odometry', 'RIHS01_12', OfferedQos().to_yaml(), count)
        for i, count in enumerate(counts)])


def loaded(folder: Path):
    return YAML(typ='safe').load((folder / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information']


def shape(value):
    """Return the keys and types of a document, without its values."""
    if isinstance(value, dict):
        return {key: shape(item) for key, item in value.items()}
    if isinstance(value, list):
        return [shape(item) for item in value[:1]]
    return type(value)


def test_it_has_the_form_that_another_writer_gives_it(tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(tmp_path / 'other', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection('/t', 'nav_msgs/msg/Odometry', typestore=store)
        writer.write(topic, 5, b'\0\1\0\0')
    other = loaded(tmp_path / 'other')
    write_metadata(tmp_path, summary(3))
    ours = loaded(tmp_path)
    for document in (ours, other):
        document['custom_data'] = None
        for entry in document['topics_with_message_count']:
            entry['topic_metadata'].pop('offered_qos_profiles')
    assert shape(ours) == shape(other)
    assert ours['version'] == other['version'] == 9
    assert ours['storage_identifier'] == other['storage_identifier'] == 'mcap'


def test_counts_and_times(tmp_path):
    write_metadata(tmp_path, summary(3, 4))
    ours = loaded(tmp_path)
    assert ours['message_count'] == 7
    assert ours['starting_time'] == {'nanoseconds_since_epoch': 5 * 10**18}
    assert ours['duration'] == {'nanoseconds': 7}
    assert ours['files'] == [{
        'path': 'x_0.mcap', 'message_count': 7, 'duration': {'nanoseconds': 7},
        'starting_time': {'nanoseconds_since_epoch': 5 * 10**18}}]
    profile = ours['topics_with_message_count'][0]['topic_metadata']['offered_qos_profiles'][0]
    assert (profile['reliability'], profile['depth']) == ('reliable', 10)
    assert profile['deadline'] == {'sec': 9223372036, 'nsec': 854775807}


def test_a_bag_without_messages_or_topics(tmp_path):
    write_metadata(tmp_path, BagSummary('x.mcap', 0, 0, []))
    ours = loaded(tmp_path)
    assert ours['topics_with_message_count'] == []
    assert ours['starting_time']['nanoseconds_since_epoch'] == 2**63 - 1
    topic = TopicSummary('/t', 'a/msg/B', '', '', 0)
    write_metadata(tmp_path, BagSummary('x.mcap', 0, 0, [topic]))
    entry = loaded(tmp_path)['topics_with_message_count'][0]['topic_metadata']
    assert (entry['type_description_hash'], entry['offered_qos_profiles']) == ('', [])


def test_the_distribution_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_DISTRO', 'kilted')
    write_metadata(tmp_path, summary(1))
    assert loaded(tmp_path)['ros_distro'] == 'kilted'


@pytest.mark.parametrize(('topic', 'durability', 'reliability'), [
    ('/robot/control_field', 'transient_local', 'reliable'),
    ('/neighbourhood', 'volatile', 'best_effort'), ('/scan', 'volatile', 'reliable')])
def test_topics_of_ours_are_played_as_they_are_published(topic, durability, reliability):
    qos = known_qos(topic)
    assert (qos.durability, qos.reliability) == (durability, reliability)


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path):
    path = tmp_path / 'a'
    write_atomically(path, b'one')
    write_atomically(path, b'two')
    assert path.read_bytes() == b'two'
    with pytest.raises(BagError, match=r'cannot write .*none/a: no such file'):
        write_atomically(tmp_path / 'none' / 'a', b'x')
    assert [entry.name for entry in tmp_path.iterdir()] == ['a']


@pytest.mark.parametrize('text', ['[' * 100_000, '- ' * 100_000, '{a: ' * 100_000, '&a [*a', '\0'])
def test_a_text_that_is_no_yaml_says_nothing(text):
    assert read_yaml(text) is None
