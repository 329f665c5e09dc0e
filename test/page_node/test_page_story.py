"""The room of the story on real nodes: the film, the figures, and how both grow."""

from collections.abc import Iterator
import re

from playwright.sync_api import Browser, expect, Page
import pytest

from page_helpers import PageStack, PHONE, running_page, visiting, Visitor
from sample_helpers import sample_copy

WAITING = 60_000
FIRST, SECOND = 'Try 1', 'Try 2'
#: Two fields of one lattice: the second one has grown by a row below and a column on the left.
#: Flags are those of the live view: 16 leads home, 32 has a heading.
COMPARED = """async () => {
  const {changesBetween, goalOf, shareHome} = await import('/story/changes.js');
  const field = (rows, cols, origin, flags, known, angle) => ({
    type: 'field', revision: 1, resolution: 0.5, rows, cols, origin,
    flags: Uint8Array.from(flags), known: Int8Array.from(known), angle: Uint8Array.from(angle)});
  const before = field(2, 2, [0, 0], [48, 48, 32, 52], [0, 0, 0, 0], [0, 0, 0, 0]);
  const after = field(3, 3, [-0.5, -0.5],
    [0, 0, 0, 32, 48, 32, 0, 48, 52], [-1, 0, 100, 0, 0, 0, -1, 0, 0],
    [0, 0, 0, 0, 64, 0, 0, 0, 9]);
  const {kinds, counts} = changesBetween(before, after);
  return {grown: [...kinds], counts,
    first: changesBetween(null, before).counts, same: changesBetween(before, before).counts,
    goal: goalOf(after), share: shareHome(after)};
}"""


@pytest.fixture(scope='module')
def page_stack(
    tmp_path_factory: pytest.TempPathFactory, ros_domain: int,
) -> Iterator[PageStack]:
    """Return a page whose robot has had a drive and two tries, and can try again, quickly."""
    folder = tmp_path_factory.mktemp('story')
    sample_copy(folder)
    with running_page(folder, ros_domain, sim_node={'world': 'task1', 'speed_factor': 5.0},
                      learner_node={'task': 'sample'}) as stack:
        yield stack


@pytest.fixture(scope='module')
def page(browser: Browser, page_stack: PageStack) -> Iterator[Page]:
    """Return one page for all: a room that is gone through is never the same again."""
    with visiting(browser, page_stack.url) as visitor:
        yield opened(visitor)


def opened(visitor: Visitor, **options: object) -> Page:
    """Open the room; it shows all there is, the last one large."""
    page = visitor.open('#story', **options)
    page.set_default_timeout(WAITING)
    expect.set_options(timeout=WAITING)
    expect(shot(page, SECOND)).to_be_checked()
    return page


def shot(page: Page, title: str) -> object:
    return page.get_by_role('radio', name=re.compile(f'^{title} '))


def told(page: Page) -> object:
    return page.locator('.shot figcaption')


def is_painted(page: Page, selector: str) -> None:
    """Wait until a picture has a few colours."""
    page.wait_for_function("""selector => {
        const canvas = document.querySelector(selector);
        // A copy that is made to be read: the browser warns of others.
        const copy = Object.assign(document.createElement('canvas'), {width: 64, height: 64});
        const context = copy.getContext('2d', {willReadFrequently: true});
        context.drawImage(canvas, 0, 0, 64, 64);
        const pixels = context.getImageData(0, 0, 64, 64);
        return new Set(new Uint32Array(pixels.data.buffer)).size > 3;
    }""", arg=selector)


def test_what_has_changed_is_found_by_where_cells_are(page):
    found = page.evaluate(COMPARED)
    # 1 is a wall, 2 gained, 3 lost, 4 turned, 5 seen; 0 is as it was, or not known.
    assert found['grown'] == [0, 5, 1, 5, 4, 3, 0, 2, 0]
    assert found['counts'] == {'wall': 1, 'gained': 1, 'lost': 1, 'turned': 1, 'seen': 2}
    assert found['first'] == {'wall': 0, 'gained': 3, 'lost': 0, 'turned': 0, 'seen': 1}
    assert not any(found['same'].values())
    assert found['goal'] == [0.75, 0.75]
    assert found['share'] == pytest.approx(3 / 6)


def test_the_film_shows_what_each_episode_has_changed(page):
    shot(page, FIRST).check(force=True)
    expect(told(page)).to_contain_text(re.compile(r'^Try 1: It reached the goal in \d+ steps\.'))
    expect(page.locator('.change.gained')).to_contain_text(re.compile(r'\d+ places? now leads? '))
    expect(page.locator('.change.wall')).to_be_visible()
    # In words, too, for who does not see the picture.
    expect(page.get_by_role('img', name=re.compile('Try 1: .* now lead'))).to_be_visible()
    is_painted(page, '.shot-map canvas')
    shot(page, 'Drive 1').check(force=True)
    expect(told(page)).to_contain_text('Drive 1: You showed it 15 steps.')
    for number in (1, 2, 3):
        is_painted(page, f'.pictures [data-number="{number}"] canvas')


def test_the_film_runs_and_is_gone_through_by_keys(page):
    page.get_by_role('button', name='Play the film').click()
    expect(shot(page, 'Drive 1')).to_be_checked()
    expect(shot(page, FIRST)).to_be_checked()
    page.get_by_role('button', name='Stop the film').click()
    expect(page.get_by_role('button', name='Play the film')).to_be_visible()
    shot(page, FIRST).focus()
    page.keyboard.press('ArrowLeft')
    expect(shot(page, 'Drive 1')).to_be_checked()
    page.keyboard.press('ArrowRight')
    page.keyboard.press('ArrowRight')
    expect(shot(page, SECOND)).to_be_checked()
    page.get_by_role('button', name='Back').click()
    expect(shot(page, FIRST)).to_be_checked()


def test_all_numbers_of_the_figures_are_there_to_be_read(page):
    page.get_by_text('All numbers').click()
    rows = page.get_by_role('row')
    expect(rows).to_have_count(4)
    expect(rows.nth(2)).to_contain_text('Try 1 ✓')
    first = [int(text) for text in rows.nth(2).locator('.number').all_inner_texts()]
    assert first[2:] == [7, 0]
    # The last one's prototypes are those of the live field.
    last = [int(text) for text in rows.nth(3).locator('.number').all_inner_texts()]
    assert last[0] > 10
    assert last[1] > 10
    assert last[2:] == [0, 0]
    for figure in page.locator('.curve').all():
        expect(figure.locator('.mark')).to_have_count(2)
    figures = [figure.inner_text() for figure in page.locator('.curve figcaption').all()]
    assert [re.findall(r'\d+', text)[-1] for text in figures] == ['5', '6', '7']


def test_a_mark_in_a_figure_leads_to_its_picture(page):
    first = page.locator('.curve').first
    first.locator('.mark').first.click()
    expect(shot(page, FIRST)).to_be_checked()


def test_nothing_is_cut_off_on_a_phone(visitor):
    page = opened(visitor, viewport=PHONE)
    assert page.evaluate('document.documentElement.scrollWidth') <= PHONE['width']
    expect(page.get_by_role('button', name='STOP')).to_be_in_viewport()
    expect(told(page)).to_be_in_viewport()


def test_a_new_try_grows_the_figures_and_becomes_the_next_picture(page):
    shot(page, SECOND).check(force=True)
    page.goto(page.url.replace('#story', '#teach'))
    page.locator('.action', has_text='Try').first.click()
    page.goto(page.url.replace('#teach', '#story'))
    expect(page.locator('.curve .running').first).to_be_visible()
    expect(shot(page, 'Try 3')).to_be_checked()
    expect(told(page)).to_contain_text('Try 3: ')
    expect(page.locator('.curve').first.locator('.mark:not(.running)')).to_have_count(3)
