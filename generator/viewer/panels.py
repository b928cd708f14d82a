"""The panels of the page, in the order of their tabs."""

from collections.abc import Callable, Sequence

from generator.viewer.body_panel import BodyPanel
from generator.viewer.curve_panel import CurvePanel
from generator.viewer.live_panel import LivePanel
from generator.viewer.play_panel import PlayPanel
from generator.viewer.pose_panel import PosePanel
from generator.viewer.viewer import Content, Panel, Viewer

PANELS: Sequence[Callable[[Viewer], Panel]] = (
    PosePanel,
    BodyPanel,
    CurvePanel,
    LivePanel,
    PlayPanel,
)


def ordered_panels(content: Content) -> Sequence[Callable[[Viewer], Panel]]:
    """Return the panels of a page; the first one is open, for a motion the one that plays it."""
    if content.motion is None:
        return PANELS
    return (PlayPanel, *(panel for panel in PANELS if panel is not PlayPanel))
