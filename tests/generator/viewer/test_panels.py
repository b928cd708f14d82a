"""Order of the tabs of the page."""

from dataclasses import replace

from generator.viewer.panels import PANELS, ordered_panels
from generator.viewer.play_panel import PlayPanel
from tests.generator.viewer.conftest import content_of
from tests.motions import clip


def test_every_tab_has_its_own_title():
    assert len({panel.title for panel in PANELS}) == len(PANELS) == 5


def test_a_motion_opens_the_tab_that_plays_it(tmp_path):
    content = content_of("prototype", tmp_path)
    assert ordered_panels(content)[-1] is PlayPanel
    motion = ordered_panels(replace(content, motion=clip("prototype")))
    assert motion[0] is PlayPanel
    assert len(motion) == len(ordered_panels(content))
