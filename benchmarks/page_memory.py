"""
Measure how fast the page shows what the robot remembers.

``python -m benchmarks.page_memory --minutes 10``: a real page_node, a bag of so many minutes with
odometry and commands at 50 Hz, wide local grids and a field of 200 x 200 cells, and Chromium. Told
are the time from a click on the row to the first picture of the drive, and from a movement of the
scrubber to the next picture, anywhere in the bag; and how long the server takes for the field of a
moment, and for why.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, Final

import numpy as np
from playwright.sync_api import Page, sync_playwright

from benchmarks.long_drive import write_long_trial
from msgs_bridge.node.environment import child_environment

_TASK: Final = 'long'
_ROW: Final = f'[data-name="{_TASK}/0001"]'
#: Milliseconds from a click to the frame after the first picture.
_OPEN: Final = """async row => {
  const frame = () => new Promise(requestAnimationFrame);
  const began = performance.now();
  row.click();
  do { await frame(); } while (document.querySelector('.scrubber').hidden);
  await frame();
  return performance.now() - began;
}"""
#: Milliseconds from a movement of the slider until the picture is drawn.
_SCRUB: Final = """async (slider, share) => {
  await new Promise(requestAnimationFrame);
  const began = performance.now();
  slider.value = share * Number(slider.max);
  slider.dispatchEvent(new Event('input', {bubbles: true}));
  await new Promise(requestAnimationFrame);
  const channel = new MessageChannel();
  await new Promise(done => {
    channel.port1.onmessage = done;
    channel.port2.postMessage(0);
  });
  return performance.now() - began;
}"""


def main() -> None:
    """Run the benchmark and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--minutes', type=float, default=10.0, help='length of the bag')
    parser.add_argument('--runs', type=int, default=5, help='times it is opened afresh')
    parser.add_argument('--moments', type=int, default=100, help='places gone to, a run')
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bags = Path(folder) / 'bags'
        bag = write_long_trial(bags, _TASK, 60.0 * arguments.minutes).bag
        print(f'a bag of {arguments.minutes:g} min, {bag.stat().st_size / 1e6:.0f} MB')
        for name, times in _measure(bags, arguments.runs, arguments.moments).items():
            print(f'{name:14} least {min(times):6.0f}  median {np.median(times):6.0f}  '
                  f'p95 {np.percentile(times, 95):6.0f}  most {max(times):6.0f} ms '
                  f'({len(times)})')


def _measure(bags: Path, n_runs: int, n_moments: int) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {'first picture': [], 'scrub': [], 'field': [], 'why': []}
    rng = np.random.default_rng(0)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which('chromium'),
            args=[] if os.getuid() else ['--no-sandbox'])
        for _ in range(n_runs):
            # Each time another process that has not read the bag yet, but is ready to.
            with _running(bags) as url:
                page = _opened(browser.new_context(base_url=url), url)
                found['first picture'].append(page.locator(_ROW).evaluate(_OPEN))
                page.wait_for_load_state('networkidle')
                slider = page.locator('.moment')
                found['scrub'] += [slider.evaluate(_SCRUB, share)
                                   for share in rng.random(n_moments).tolist()]
                for what in ('field', 'why'):
                    found[what] += [_load(page, what, at)
                                    for at in (60.0 * rng.random(10)).tolist()]
                page.context.close()
        browser.close()
    return found


def _opened(context: Any, url: str) -> Page:
    page: Page = context.new_page()
    page.goto(f'{url}#memory')
    page.wait_for_selector(_ROW)
    page.wait_for_load_state('networkidle')
    _load(page, 'why', 1.0, number=9)  # what it still makes ready is over then
    return page


def _load(page: Page, what: str, at: float, number: int = 1) -> float:
    """Return how long the server takes to answer, [ms]."""
    began = time.perf_counter()
    page.request.get(f'/api/episodes/{_TASK}/{number}/{what}?at={at:.3f}').body()
    return 1e3 * (time.perf_counter() - began)


@contextmanager
def _running(bags: Path) -> Iterator[str]:
    """Start page_node alone; yield its address."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'page_node.node', '--ros-args', '-p', 'port:=0', '-p',
         f'bags:={bags}'], stdout=subprocess.PIPE, text=True, env=child_environment())
    try:
        assert process.stdout is not None
        address = re.search(r'http\S+', process.stdout.readline())
        assert address is not None
        yield address[0]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(10.0)


if __name__ == '__main__':
    main()
