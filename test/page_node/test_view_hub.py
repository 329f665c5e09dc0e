"""What viewers get: the newest of each kind, the whole way driven, and no more than they see."""

import json

import numpy as np

from page_node.server.view_hub import MOST_UNSEEN, Viewer, ViewHub


def frames(messages):
    """Return the frames of the messages that are batches."""
    return [frame for message in messages if isinstance(message, str)
            for frame in json.loads(message)]


def kinds(messages):
    return [frame['type'] for frame in frames(messages)]


def joined(hub):
    """Return a viewer that has got what there was."""
    viewer = Viewer(hub)
    viewer.messages()
    return viewer


class TestFrames:
    def test_who_joins_gets_the_newest_of_each_kind(self):
        hub = ViewHub()
        for x in range(3):
            hub.put('robot', {'x': x})
            hub.put('state', {'n': x})
        assert frames(Viewer(hub).messages())[:2] == [
            {'type': 'robot', 'x': 2}, {'type': 'state', 'n': 2}]

    def test_who_is_there_gets_what_is_new(self):
        hub = ViewHub()
        hub.put('state', {})
        viewer = joined(hub)
        assert viewer.messages() == []
        hub.put('robot', {'x': 1})
        assert kinds(viewer.messages()) == ['robot']
        assert viewer.messages() == []

    def test_a_slow_viewer_misses_frames_and_gets_the_newest(self):
        hub = ViewHub()
        viewer = joined(hub)
        for x in range(1000):
            hub.put('robot', {'x': x})
        assert [frame['x'] for frame in frames(viewer.messages())] == [999]

    def test_a_big_frame_is_a_message_of_its_own_behind_the_batch(self):
        hub = ViewHub()
        hub.put('field', {'rows': 2}, {'angle': np.arange(4, dtype='u1').reshape(2, 2)})
        hub.put('state', {})
        batch, big = Viewer(hub).messages()
        assert kinds([batch]) == ['state', 'trail']
        length = int.from_bytes(big[:4], 'little')
        header = json.loads(big[4:4 + length])
        assert header['type'] == 'field'
        assert big[4 + length:] == bytes(range(4))

    def test_a_frame_is_written_once_for_all(self):
        hub = ViewHub()
        hub.put('field', {}, {'angle': np.zeros(4, 'u1')})
        assert Viewer(hub).messages()[1] is Viewer(hub).messages()[1]

    def test_what_is_dropped_is_not_shown_to_who_comes_later(self):
        hub = ViewHub()
        hub.put('sight', {})
        hub.drop('sight')
        assert kinds(Viewer(hub).messages()) == ['trail']


class TestTrail:
    def test_it_comes_whole_first_and_then_what_is_new(self):
        hub = ViewHub()
        hub.begin_trail('demo', [(0.0, 0.0)])
        hub.extend_trail([(1.0, 0.0)])
        viewer = Viewer(hub)
        assert frames(viewer.messages()) == [
            {'type': 'trail', 'kind': 'demo', 'points': [[0.0, 0.0], [1.0, 0.0]]}]
        hub.extend_trail([(2.0, 0.0)])
        hub.extend_trail([(3.0, 0.0)])
        assert frames(viewer.messages()) == [
            {'type': 'trail_more', 'kind': 'demo', 'points': [[2.0, 0.0], [3.0, 0.0]]}]
        assert viewer.messages() == []

    def test_another_one_comes_whole(self):
        hub = ViewHub()
        hub.begin_trail('demo', [(0.0, 0.0)])
        viewer = joined(hub)
        hub.begin_trail('trial', [(5.0, 5.0)])
        assert frames(viewer.messages()) == [
            {'type': 'trail', 'kind': 'trial', 'points': [[5.0, 5.0]]}]


class TestSeeing:
    def test_who_has_not_seen_enough_is_not_ready(self):
        hub = ViewHub()
        viewer = Viewer(hub)
        for x in range(MOST_UNSEEN):
            assert viewer.is_ready
            hub.put('robot', {'x': x})
            viewer.messages()
        assert not viewer.is_ready
        assert viewer.see(1)
        assert viewer.is_ready

    def test_one_sees_no_more_than_was_sent_and_forgets_nothing(self):
        viewer = joined(ViewHub())
        assert not viewer.see(2)
        assert viewer.see(1)
        assert not viewer.see(0)
