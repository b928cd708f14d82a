"""Any log of a live simulation that a file can hold."""

from typing import Any

from hypothesis import strategies as st

from generator.input_files.live import (
    LiveLog,
    LiveStart,
    LoggedChange,
    SetFloor,
    SetForce,
    SetGravity,
    SetRoot,
    SetScales,
    SetSprings,
    StopMotion,
)
from generator.run_options import MAX_LIVE_SEED
from springs import SphericalLaw


def numbers(largest=1e3):
    return st.floats(-largest, largest)


def vectors(largest=1e3):
    return st.tuples(*[numbers(largest)] * 3)


scales = st.floats(0.0, 1e3)
texts = st.text(max_size=60).map(lambda text: text.replace("\r\n", "\n").replace("\r", "\n"))
changes = st.one_of(
    st.builds(SetGravity, vectors()),
    st.builds(SetScales, scales, scales),
    st.builds(SetFloor, st.none() | numbers()),
    st.builds(SetRoot, st.booleans()),
    st.builds(SetForce, texts, vectors(), vectors(1e6)),
    st.builds(SetSprings, texts),
    st.just(StopMotion()),
)
starts = st.builds(
    LiveStart,
    st.none() | texts,
    st.none() | st.sampled_from(SphericalLaw),
    vectors(),
    st.none() | numbers(),
    st.booleans(),
    st.floats(1e-12, 0.1),
    st.floats(1e-4, 1.0),
    texts,
    texts,
    st.integers(0, MAX_LIVE_SEED),
    texts,
    st.none() | numbers(),
)


@st.composite
def live_logs(draw: Any) -> LiveLog:
    made = draw(st.lists(changes, max_size=5))
    frames = sorted(draw(st.lists(st.integers(0, 500), min_size=len(made), max_size=len(made))))
    logged = tuple(map(LoggedChange, frames, made))
    digest = draw(st.none() | st.just("0f"))
    return LiveLog(draw(texts), digest, draw(starts), logged, draw(st.integers(500, 900)))
