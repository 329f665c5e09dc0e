"""Each room of the page can be used by keyboard and screen reader, as far as axe can tell."""

from axe_playwright_python.sync_playwright import Axe
import pytest

from page_helpers import LAPTOP, PHONE, PROJECTOR
from sample_helpers import sample_copy

ROOMS = ('teach', 'memory', 'story', 'worlds')
#: Each size and each colour once; and as those see it who want no movement.
LOOKS = {
    'phone': {'viewport': PHONE, 'has_touch': True, 'color_scheme': 'dark', 'locale': 'fr'},
    'laptop': {'viewport': LAPTOP, 'color_scheme': 'light', 'locale': 'de'},
    'projector': {'viewport': PROJECTOR, 'color_scheme': 'dark', 'reduced_motion': 'reduce',
                  'locale': 'es'}}


@pytest.fixture(scope='module')
def node_changes(tmp_path_factory):
    """Let the robot remember something, so that no room is empty."""
    task = sample_copy(tmp_path_factory.mktemp('memory'))
    bags = {'bags': str(task.path.parent)}
    return {'learner_node': {**bags, 'task': task.task}, 'page_node': bags}


@pytest.mark.parametrize('look', LOOKS)
def test_no_room_has_a_violation(visitor, look):
    page = visitor.open(**LOOKS[look])
    for room in ROOMS:
        page.goto(f'{page.url.partition("#")[0]}#{room}')
        page.wait_for_selector(f'#room-{room}:not([hidden])')
        page.wait_for_load_state('networkidle')
        found = Axe().run(page).response
        assert len(found['passes']) > 15, f'{room} on a {look}: hardly anything to look at'
        assert [(one['id'], [node['target'] for node in one['nodes']])
                for one in found['violations']] == [], f'{room} on a {look}'
        width = page.evaluate('document.documentElement.scrollWidth')
        assert width <= LOOKS[look]['viewport']['width'], f'{room} on a {look} is too wide'
