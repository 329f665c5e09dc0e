"""What a bag says of itself."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import pytest

from bridge_helpers import grids, refusal
from control_field.grid import Grid
from control_field.parameters import Parameters
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind

HEADER = EpisodeHeader(EpisodeKind.DEMO, 'task1', Grid(20, 20, 0.25))


@given(grids, st.sampled_from(EpisodeKind), st.floats(0.5, 16.0))
def test_round_trip(grid, kind, power):
    header = EpisodeHeader(kind, 'task1', grid, Parameters(power=power), {'odom': '/robot/odom'})
    values = header.to_mapping()
    assert all(isinstance(value, str) for value in values.values())
    assert EpisodeHeader.from_mapping(values) == header


@pytest.mark.parametrize(('key', 'value', 'sentence'), [
    ('version', '2', 'version of the bag is 2, must be 1'),
    ('version', None, 'version of the bag is missing, must be 1'),
    ('kind', 'film', "makes no sense: 'film' is not a valid EpisodeKind"),
    ('kind', None, 'the header of the bag has no kind'),
    ('grid', '{}', 'makes no sense'),
    ('grid', '[' * 100_000, 'makes no sense'),
    ('grid', '{"n_rows": 0, "n_cols": 1, "resolution": 1.0}', 'n_rows is 0'),
    ('grid', '[]', 'grid is no object'),
    ('grid', 'x', 'makes no sense'),
    ('parameters', '{"power": 99.0}', 'power is 99.0, must be between'),
    ('parameters', '{"speed": 1}', 'speed is no parameter'),
    ('topics', '{"odom": 3}', 'topics must be texts'),
])
def test_what_makes_no_sense(key, value, sentence):
    values = HEADER.to_mapping()
    values.pop(key)
    if value is not None:
        values[key] = value
    with pytest.raises(BagError, match=sentence):
        EpisodeHeader.from_mapping(values)


@given(st.dictionaries(st.sampled_from(['version', 'kind', 'grid', 'parameters', 'topics']),
                       st.text(max_size=20)))
def test_any_texts(changes):
    refusal(lambda: EpisodeHeader.from_mapping(HEADER.to_mapping() | changes), BagError)


@pytest.mark.parametrize('other', [
    Grid(20, 21, 0.25), Grid(20, 20, 0.26), Grid(20, 20, 0.25, 1.0), Grid(20, 20, 0.25, 0.0, -1.0),
    Grid(20, 20, 0.25, frame_id='map')], ids=str)
def test_another_workspace_is_refused_and_both_are_named(other):
    HEADER.check_grid(Grid(20, 20, 0.25), Path('bag'))
    with pytest.raises(BagError) as error:
        HEADER.check_grid(other, Path('bag'))
    assert str(error.value).startswith(
        "bag was recorded on 20 x 20 cells of 0.25 m from (0, 0) in 'odom', this workspace is ")
    assert repr(other.frame_id) in str(error.value)
