"""The report in a browser: nothing on the console, no request, and timelines that obey."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from hil_tests.reporting.html import write_report
from tests.reporting.html.chromium import PROGRAM, READY, Browser, browser
from tests.reporting.html.making import HEAD, HOSTILE, failed, make_run, passed, result

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PROGRAM, reason="chromium is not installed"),
]

VIEW = """(t => [t.from, t.to, t.frame, t.check])(
  document.querySelector('details[open] .timeline').timeline)"""


@pytest.fixture(name="tab", scope="module")
def _tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser for all tests of this file."""
    with browser(tmp_path_factory.mktemp("chromium")) as tab:
        yield tab


@pytest.fixture(name="page", scope="module")
def _page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report with a failure."""
    folder = tmp_path_factory.mktemp("report") / "run"
    second = result(2, passed(), failed(), outcome="failed", text="too late")
    return write_report(make_run(folder, result(1, passed()), second), {})


@pytest.fixture(name="shown")
def _shown(tab: Browser, page: Path) -> Browser:
    """That report, with its first timeline in view and in focus."""
    tab.open(page)
    assert tab.run(READY)
    tab.run("document.querySelector('details[open] .timeline canvas').focus()")
    return tab


def place_of(tab: Browser, at_ns: float, lane: str) -> tuple[float, float]:
    """Where an instant of a lane is on the screen."""
    x, y = tab.run(
        f"""(t => {{
          const box = t.canvas.getBoundingClientRect();
          const lane = t.lanes.findIndex(lane => lane.name.includes('{lane}'));
          return [box.x + t.x({at_ns}), box.y + t.top(lane) + 11];
        }})(document.querySelector('details[open] .timeline').timeline)"""
    )
    return float(x), float(y)


def test_nothing_is_said_and_nothing_is_asked_for(shown: Browser, page: Path) -> None:
    """The console stays empty, and the file itself is all that is read."""
    assert shown.complaints() == []
    assert shown.requests() == [page.as_uri()]


def test_the_policy_is_obeyed(shown: Browser) -> None:
    """A script that gets into the page is not run, an image is not loaded."""
    shown.run(
        """(() => {
          const script = document.createElement('script');
          script.textContent = 'window.pwned = 1';
          document.body.append(script);
          const image = document.createElement('img');
          image.src = 'http://example.invalid/x.png';
          document.body.append(image);
        })()"""
    )
    assert shown.run("typeof window.pwned") == "undefined"
    assert any("Content Security Policy" in complaint for complaint in shown.complaints())


def test_every_link_on_the_page_works(shown: Browser) -> None:
    """Each anchor is there, and the page of a test that was folded unfolds."""
    dead = shown.run(
        """[...document.querySelectorAll('a[href^="#"]')].map(a => a.getAttribute('href').slice(1))
           .filter(id => !document.getElementById(id))"""
    )
    assert dead == []
    unfolded = shown.run(
        """new Promise(done => {
          const page = document.getElementById('t1').closest('details');
          const before = page.open;
          location.hash = '#t1';
          setTimeout(() => done([before, page.open]), 100);
        })"""
    )
    assert unfolded == [False, True]


def test_the_first_failure_is_one_click_away(shown: Browser) -> None:
    """The button of the verdict leads to the page of the failed test."""
    shown.run("document.querySelector('.button').click()")
    assert shown.run("location.hash") == "#t2"
    assert shown.run("document.getElementById('t2').getBoundingClientRect().top < innerHeight")


def test_a_timeline_opens_at_the_finding(shown: Browser) -> None:
    """The failed check is chosen, with the frame that it judged, and told in words."""
    from_ns, to_ns, frame, check = shown.run(VIEW)
    assert from_ns < 50e6
    assert to_ns > 161e6
    assert (frame, check) == (1, 1)
    said = shown.run("document.querySelector('details[open] .said').textContent")
    assert "081#0050010000000000" in said
    assert "failed: EMCY 50xxh" in said


def test_keys_walk_from_frame_to_frame(shown: Browser) -> None:
    """Right and left choose the next frame and the one before; Home and End the outermost."""
    for key, frame in (("ArrowRight", 2), ("ArrowLeft", 1), ("End", 3), ("Home", 0)):
        shown.press(key)
        assert shown.run(VIEW)[2] == frame


def test_keys_zoom_and_move(shown: Browser) -> None:
    """Plus halves the view, minus doubles it, 0 shows all, page down moves on."""
    before = shown.run(VIEW)
    shown.press("+")
    after = shown.run(VIEW)
    assert after[1] - after[0] == pytest.approx((before[1] - before[0]) / 2)
    shown.press("+")
    start = shown.run(VIEW)[0]
    shown.press("PageDown")
    assert shown.run(VIEW)[0] > start
    shown.press("0")
    from_ns, to_ns, *_ = shown.run(VIEW)
    assert from_ns <= 0
    assert to_ns >= 260e6


def test_n_goes_to_the_next_check(shown: Browser) -> None:
    """From the last check on it goes round to the first."""
    shown.press("n")
    assert shown.run(VIEW)[3] == 0
    shown.press("p")
    assert shown.run(VIEW)[3] == 1


def test_a_click_chooses_a_frame(shown: Browser) -> None:
    """The frame under the pointer is chosen and decoded."""
    shown.press("0")
    x, y = place_of(shown, 170e6, "NMT")
    shown.mouse("Pressed", x, y, button="left", clickCount=1)
    shown.mouse("Released", x, y, button="left", clickCount=1)
    assert shown.run(VIEW)[2] == 2
    assert "NMT start -> node 1" in shown.run(
        "document.querySelector('details[open] .said').textContent"
    )


def test_dragging_zooms(shown: Browser) -> None:
    """What was dragged over fills the view afterwards."""
    shown.press("0")
    (left, y), (right, _) = place_of(shown, 40e6, "NMT"), place_of(shown, 120e6, "NMT")
    shown.mouse("Pressed", left, y, button="left", buttons=1, clickCount=1)
    shown.mouse("Moved", (left + right) / 2, y, button="left", buttons=1)
    shown.mouse("Moved", right, y, button="left", buttons=1)
    shown.mouse("Released", right, y, button="left", clickCount=1)
    from_ns, to_ns, *_ = shown.run(VIEW)
    assert from_ns == pytest.approx(40e6, abs=2e6)
    assert to_ns == pytest.approx(120e6, abs=2e6)


def test_the_wheel_zooms_where_the_pointer_is(shown: Browser) -> None:
    """What is under the pointer stays there."""
    shown.press("0")
    x, y = place_of(shown, 170e6, "NMT")
    width = shown.run(VIEW)[1] - shown.run(VIEW)[0]
    shown.mouse("Wheel", x, y, deltaX=0, deltaY=-120)
    from_ns, to_ns, *_ = shown.run(VIEW)
    assert to_ns - from_ns < width
    assert place_of(shown, 170e6, "NMT")[0] == pytest.approx(x, abs=1.5)


def test_dark_and_light_can_be_chosen(shown: Browser) -> None:
    """The button changes the ground of the page, and back."""
    ground = "getComputedStyle(document.body).backgroundColor"
    first = shown.run(ground)
    shown.run("document.getElementById('theme').click()")
    second = shown.run(ground)
    shown.run("document.getElementById('theme').click()")
    assert second != first
    assert shown.run(ground) == first


def test_hostile_texts_do_nothing(tab: Browser, tmp_path: Path) -> None:
    """Markup in names, texts and recordings runs nothing, loads nothing, says nothing."""
    bad = failed()._replace(requirement=HOSTILE, what=HOSTILE, text=HOSTILE)
    one = replace(result(1, bad, outcome="failed", text=HOSTILE), test=HOSTILE, title=HOSTILE)
    head = {**HEAD, "command": [HOSTILE], "bench": {"name": HOSTILE, "facilities": [HOSTILE]}}
    page = write_report(make_run(tmp_path / "run", one, head=head), {HOSTILE: [HOSTILE]})
    tab.open(page)
    assert tab.run(READY)
    assert "pwned" in tab.run("document.querySelector('details[open] .said').textContent")
    assert tab.run("document.querySelectorAll('img').length") == 0
    assert tab.complaints() == []
    assert tab.requests() == [page.as_uri()]
