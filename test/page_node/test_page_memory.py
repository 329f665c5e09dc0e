"""The room of memory on real nodes: rows, a drive gone through, why; what is gone or broken."""

from collections.abc import Iterator
import re
import shutil

from playwright.sync_api import expect, Page
import pytest

from page_helpers import PageStack, PHONE, running_page, Visitor
from ros_helpers import wait_until
from sample_helpers import sample_copy

WAITING = 30_000
#: What the browser itself notes of an answer that is a refusal.
REFUSED = 'Failed to load resource'


@pytest.fixture(scope='module')
def page_stack(
    tmp_path_factory: pytest.TempPathFactory, ros_domain: int,
) -> Iterator[PageStack]:
    """Return a page whose robot remembers the sample drives, and a learner that holds them."""
    folder = tmp_path_factory.mktemp('memory')
    sample_copy(folder)
    with running_page(folder, ros_domain, sim_node=None, control_field_node=None,
                      learner_node={'task': 'sample'}) as stack:
        yield stack


@pytest.fixture
def page(visitor: Visitor) -> Page:
    return opened(visitor)


def opened(visitor: Visitor, **options: object) -> Page:
    """Open the room; every row is there, and was read."""
    page = visitor.open('#memory', **options)
    page.set_default_timeout(WAITING)
    expect.set_options(timeout=WAITING)
    for number in (1, 2, 3):
        expect(row(page, number).locator('img')).to_have_js_property('complete', value=True)
    return page


def row(page: Page, number: int) -> object:
    return page.locator(f'[data-name="sample/000{number}"]')


def look_at(page: Page, number: int) -> None:
    row(page, number).click()
    title = row(page, number).locator('strong').inner_text()
    expect(page.locator('.player h2')).to_have_text(title)
    expect(page.locator('.scrubber')).to_be_visible()


def second(page: Page) -> float:
    return float(page.locator('.moment').input_value())


def test_every_drive_is_a_row_with_a_picture_when_and_how_it_ended(page):
    rows = page.locator('.memory-list > ol .episode')
    assert [text.split('\n')[0] for text in rows.all_inner_texts()] == [
        'Try 2', 'Try 1', 'Drive 1']
    assert 'Reached the goal' in rows.first.inner_text()
    assert '19.4 s' in rows.first.inner_text()
    for picture in rows.locator('img').all():
        assert picture.evaluate('image => image.naturalWidth') > 0


def test_keys_alone_go_through_a_drive_and_ask_why(page):
    row(page, 2).focus()
    page.keyboard.press('Enter')
    expect(page.locator('.player h2')).to_be_focused()
    expect(page.locator('.scrubber')).to_be_visible()
    moment = page.locator('.moment')
    moment.focus()
    for _ in range(3):
        page.keyboard.press('PageUp')
    at = second(page)
    assert at > 0.0
    expect(moment).to_have_attribute('aria-valuetext', re.compile(' s$'))
    page.keyboard.press('ArrowRight')
    assert at < second(page) < at + 0.5
    expect(page.locator('.why .sentence')).to_contain_text('It drove')
    expect(page.locator('.voices .share').first).to_have_text(re.compile(r'^\d+%$'))
    assert 'The robot is at' in page.locator('.player canvas').get_attribute('aria-label')


def test_a_refused_heading_is_told_and_the_decisions_lead_to_it(page):
    look_at(page, 2)
    told = page.locator('.why .sentence')
    for _ in range(15):
        page.get_by_label('Next decision').click()
        expect(page.locator('.why')).not_to_have_attribute('aria-busy', 'true')
        if 'something was in the way' in told.inner_text():
            break
    expect(told).to_contain_text('around something in its way')
    # It is marked beside the slider, too.
    assert page.locator('.mark.avoid').count() > 0


def test_what_had_a_say_leads_to_the_second_it_was_shown(page):
    look_at(page, 2)
    page.locator('.moment').fill('9')
    source = page.locator('.source').first
    expect(source).to_have_text(re.compile(r'Drive 1 at [\d.]+ s \(shown\)'))
    shown = float(re.search(r'at ([\d.]+) s', source.inner_text())[1])
    source.click()
    expect(page.locator('.player h2')).to_have_text('Drive 1')
    expect(page.locator('.why .sentence')).to_have_text('A person drove here.')
    assert second(page) == pytest.approx(shown, abs=0.1)


def test_it_plays_at_any_speed_to_the_end_and_can_be_paused(page):
    look_at(page, 3)
    page.get_by_label('Speed of the replay').select_option('10')
    page.get_by_label('Play', exact=True).click()
    wait_until(lambda: second(page) > 1.0)
    page.get_by_label('Pause', exact=True).click()
    assert 1.0 < second(page) < 19.4
    page.get_by_label('Play', exact=True).click()
    wait_until(lambda: second(page) > 19.3)
    expect(page.get_by_label('Play', exact=True)).to_be_visible()
    expect(page.locator('.why .sentence')).to_have_text(re.compile('It drove'))


def test_on_a_phone_the_drive_takes_the_place_of_the_list_and_back_again(visitor):
    page = opened(visitor, viewport=PHONE, has_touch=True, locale='de')
    row(page, 1).tap()
    expect(page.locator('.player h2')).to_have_text('Fahrt 1')
    expect(row(page, 1)).to_be_hidden()
    expect(page.locator('.scrubber')).to_be_visible()
    assert page.evaluate('document.documentElement.scrollWidth') <= PHONE['width']
    page.locator('.to-list').tap()
    expect(row(page, 1)).to_be_focused()
    expect(page.locator('.player')).to_be_hidden()


def learner_answers(page: Page, url: str) -> bool:
    """Return whether the learner is there: it says that there is nothing to undo."""
    answer = page.request.post(
        f'{url}api/actions/undo', data={}, headers={'Origin': url.rstrip('/')})
    return answer.json()['code'] == 'nothing_there'


def test_a_drive_is_judged_removed_and_brought_back(page, page_stack):
    wait_until(lambda: learner_answers(page, page_stack.url))
    look_at(page, 3)
    page.locator('[data-memory=label_failure]').click()
    expect(row(page, 3)).to_contain_text('You said: badly')
    page.locator('[data-memory=forget]').click()
    expect(page.locator('.memory-list details .episode')).to_have_count(1)
    page.locator('.memory-side .undo').click()
    expect(page.locator('.memory-list > ol .episode')).to_have_count(3)
    page.locator('[data-memory=label_success]').click()
    expect(row(page, 3)).to_contain_text('You said: well')


def test_a_drive_that_is_deleted_while_it_is_shown_stays_and_that_is_said(
        visitor, page, page_stack):
    task, aside = page_stack.bags / 'sample', page_stack.folder / 'aside'
    look_at(page, 1)
    (task / '0001_demo').rename(aside)
    try:
        page.locator('.moment').fill('3')
        expect(page.locator('.why .sentence')).to_contain_text('not there any more')
        expect(page.locator('.player > .note')).to_contain_text('not there any more')
        expect(row(page, 1)).to_have_count(0)
        page.locator('.moment').fill('12')
        assert second(page) == 12.0
    finally:
        aside.rename(task / '0001_demo')
    forgive_refusals(visitor)


def test_a_damaged_and_a_foreign_bag_say_what_they_are(visitor, page_stack):
    task = page_stack.bags / 'sample'
    shutil.copytree(task / '0002_trial', task / '0004_trial')
    broken = task / '0004_trial' / '0004_trial_0.mcap'
    (task / '0004_trial' / '0002_trial_0.mcap').rename(broken)
    broken.write_bytes(b'no bag at all')
    (task / 'of_another').mkdir()
    (task / 'of_another' / 'drive.db3').write_bytes(b'')
    try:
        page = opened(visitor)
        expect(page.locator('.memory-list')).to_contain_text('of_another')
        expect(row(page, 4)).to_contain_text('Cannot be read')
        row(page, 4).click()
        expect(page.locator('.player > .note')).to_contain_text('damaged')
        expect(page.locator('.scrubber')).to_be_hidden()
    finally:
        for name in ('0004_trial', 'of_another'):
            shutil.rmtree(task / name)
    forgive_refusals(visitor)


def forgive_refusals(visitor: Visitor) -> None:
    """Take out of the problems what was asked for on purpose."""
    visitor.problems[:] = [each for each in visitor.problems if REFUSED not in each]
