"""Results of the runs of a study, in arrays: those of a million runs take some 40 MB."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from generator.rotations import Array
from generator.study.study import RunResult


class _Texts:
    """A text for each run; few of them differ."""

    def __init__(self, count: int) -> None:
        self.texts = list[str]()
        self.numbers: NDArray[np.uint32] = np.zeros(count, np.uint32)
        self._known: dict[str, int] = {}

    def __getitem__(self, index: int) -> str:
        return self.texts[int(self.numbers[index])]

    def __setitem__(self, index: int, text: str) -> None:
        number = self._known.setdefault(text, len(self.texts))
        if number == len(self.texts):
            self.texts.append(text)
        self.numbers[index] = number


class RunResults(Sequence[RunResult]):
    """Results by the index of their run; a run may have none yet.

    Attributes:
        finished: whether a run has a result, shape (runs,).
    """

    def __init__(self, measures: Iterable[str], runs: int) -> None:
        """Make room for a number of runs with these measures."""
        self._measures = tuple(measures)
        self._numbers: Array = np.zeros((runs, len(self._measures)))
        self._has_number: NDArray[np.bool_] = np.zeros(self._numbers.shape, bool)
        self._outcomes, self._messages = _Texts(runs), _Texts(runs)
        self.finished: NDArray[np.bool_] = np.zeros(runs, bool)

    def __len__(self) -> int:
        """Return the number of runs, with and without a result."""
        return len(self.finished)

    @overload
    def __getitem__(self, index: int) -> RunResult: ...
    @overload
    def __getitem__(self, index: slice) -> list[RunResult]: ...
    def __getitem__(self, index: int | slice) -> RunResult | list[RunResult]:
        """Return the result of a run. Raises IndexError for one without."""
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        if not self.finished[index]:
            raise IndexError(f"run {index} has no result")
        numbers = zip(self._numbers[index].tolist(), self._has_number[index].tolist(), strict=True)
        measures = {
            name: number if is_known else None
            for name, (number, is_known) in zip(self._measures, numbers, strict=True)
        }
        return RunResult(self._outcomes[index], self._messages[index], measures)

    def __setitem__(self, index: int, result: RunResult) -> None:
        """Store the result of a run, in place of one that it may have."""
        for k, name in enumerate(self._measures):
            number = result.measures[name]
            self._has_number[index, k] = number is not None
            self._numbers[index, k] = 0.0 if number is None else number
        self._outcomes[index], self._messages[index] = result.outcome, result.message
        self.finished[index] = True

    def __iter__(self) -> Iterator[RunResult]:
        """Yield the results in the order of the runs. Raises IndexError if a run has none."""
        return (self[index] for index in range(len(self)))

    def __eq__(self, other: object) -> bool:
        """Return whether the results of all runs are equal."""
        return isinstance(other, RunResults) and list(self) == list(other)

    __hash__: Any = None

    def numbers(self, measure: str) -> Array:
        """Return a measure of all runs that have it, in their order."""
        k = self._measures.index(measure)
        return self._numbers[self.finished & self._has_number[:, k], k]

    def have_outcome(self, outcome: str) -> NDArray[np.bool_]:
        """Return whether a run has ended with an outcome, shape (runs,)."""
        if outcome not in self._outcomes.texts:
            return np.zeros(len(self), bool)
        number = self._outcomes.texts.index(outcome)
        return self.finished & (self._outcomes.numbers == number)

    def count_outcomes(self) -> Mapping[str, int]:
        """Return the number of runs of each outcome, in the order of their first runs."""
        numbers, first, counts = np.unique(
            self._outcomes.numbers[self.finished], return_index=True, return_counts=True
        )
        return {
            self._outcomes.texts[numbers[k]]: int(counts[k]) for k in np.argsort(first).tolist()
        }
