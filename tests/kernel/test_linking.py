"""What is relied on of numba: a kernel that only kernels call costs them no machine code."""

import os
import pickle
from collections.abc import Callable, Iterator
from typing import Any, cast

import numpy as np
import pytest
from numba.core.compiler import Flags
from numba.core.errors import TypingError
from numba.core.targetconfig import ConfigStack

from adeye.kernel.jit import allocating, compiled, compiler, inlined
from adeye.kernel.linking import Kernel, _options, _remembered
from adeye.signals import Floats

pytestmark = pytest.mark.skipif(
    bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="nothing is compiled"
)

# From here on, what is decorated is numba's own.
compiler()


@compiled
def shifted(value: float, by: int = 1) -> float:
    return value / 3.0 + by


@inlined
def bent(value: float) -> float:
    return shifted(value, by=7) * 0.1 - value * value


@compiled
def total_of(values: Floats) -> float:
    total = 0.0
    for value in values:
        total += bent(value) - shifted(value, 0) + shifted(value, values.shape[0]) + shifted(value)
    return total


@allocating
def ramp(length: int) -> Floats:
    values = np.empty(length)
    for place in range(length):
        values[place] = shifted(0.0, place)
    return values


@allocating
def sum_of_ramps(lengths: int) -> float:
    total = 0.0
    for length in range(lengths):
        total += total_of(ramp(length))
    return total


def numba_of(function: object) -> Any:
    """Return a kernel as what numba takes it for."""
    return cast("Any", function)


def compile_anew(function: Callable[..., Any], *arguments: Any) -> None:
    """Compile a kernel for these arguments though it may be kept from an earlier process."""
    function(*arguments)
    numba_of(function).recompile()


def linked_of(function: object) -> list[Any]:
    """List what callers of a kernel have been given."""
    return list(numba_of(function)._linked.values())


def test_kernels_compute_together_what_they_compute_in_python() -> None:
    values = np.array([1.0, -2.5, 1e300, 0.1])
    expected = 0.0
    for x in values.tolist():
        bend = (x / 3.0 + 7) * 0.1 - x * x
        expected += bend - (x / 3.0 + 0) + (x / 3.0 + 4) + (x / 3.0 + 1)
    assert total_of(values) == expected
    assert sum_of_ramps(4) == sum(total_of(np.arange(n, dtype=np.float64)) for n in range(4))


@compiled
def tripled(value: float) -> float:
    return 3.0 * value


@compiled
def one_more(value: float) -> float:
    return tripled(value) + 1.0


@compiled
def two_more(value: float) -> float:
    return one_more(value) + 1.0


def test_what_only_kernels_call_has_no_machine_code_and_no_door_for_python() -> None:
    compile_anew(two_more, 2.0)
    for kernel in (tripled, one_more):
        (linked,) = linked_of(kernel)
        assert not numba_of(kernel).signatures
        for name in (linked.fndesc.llvm_func_name, linked.fndesc.llvm_cpython_wrapper_name):
            assert not linked.library.get_pointer_to_function(name)
        # What it calls is linked once, into the kernel that Python calls.
        defined = {function.name for function in linked.library.get_defined_functions()}
        assert defined == {linked.fndesc.llvm_func_name}
    # Python can call it all the same, and its callers keep what they have.
    assert one_more(3.0) == 10.0
    assert linked_of(one_more) == [linked]


@compiled
def root(value: float) -> float:
    if value < 0.0:
        raise ValueError("no root")
    return float(np.sqrt(value))


@compiled
def rooted(value: float) -> float:
    return 1.0 + root(value)


def test_an_error_in_a_linked_kernel_reaches_python() -> None:
    assert rooted(4.0) == 3.0
    with pytest.raises(ValueError, match="no root"):
        rooted(-1.0)


def test_a_literal_takes_no_function_of_its_own() -> None:
    compile_anew(total_of, np.ones(2))
    compile_anew(sum_of_ramps, 2)
    # As an argument, and left out.
    assert len(linked_of(shifted)) == 2


def test_equal_options_are_one_object_and_what_numba_compiles_inherits_no_kind_of_kernel() -> None:
    flags = Flags()
    flags.error_model = "numpy"
    flags.nrt = flags.forceinline = flags.no_compile = True
    options = _options(flags)
    assert options is _options(Flags(flags))
    assert options.forceinline
    assert options.no_compile
    inherited = options.copy()
    inherited.no_cpython_wrapper = True
    assert not options.no_cpython_wrapper
    inherited = options.copy()
    assert (inherited.error_model, inherited.nrt) == ("numpy", True)
    assert not inherited.forceinline
    assert not inherited.no_compile


@allocating
def moved(values: Floats) -> Floats:
    return np.sqrt(values) + np.zeros(values.shape[0]) + 1.0


@allocating
def moved_twice(values: Floats) -> float:
    return float(moved(moved(values)).sum())


def test_arrays_can_be_computed_with_as_a_whole() -> None:
    for _ in range(2):
        assert moved(np.array([4.0, 9.0])).tolist() == [3.0, 4.0]
    assert moved_twice(np.array([9.0])) == 3.0
    assert total_of(np.array([1.0])) == total_of.py_func(np.array([1.0]))  # type: ignore[attr-defined]


@compiled
def thirds(length: int) -> Iterator[float]:
    for place in range(length):
        yield place / 3.0


@compiled
def sum_of_thirds(length: int) -> float:
    total = 0.0
    for value in thirds(length):
        total += value
    return total


def test_a_generator_keeps_what_lives_between_its_values() -> None:
    assert sum_of_thirds(4) == 0.0 + 1 / 3.0 + 2 / 3.0 + 3 / 3.0


def test_what_an_operator_returns_is_looked_up_once_for_some_types_and_options() -> None:
    asked: list[object] = []

    def looked_up(_self: object, _context: object, args: object, _kws: object) -> object:
        asked.append(args)
        return object()

    class Operator:
        pass

    call_type, operator = _remembered(looked_up), Operator()
    # What others compile is left as it is.
    first = call_type(operator, None, ("int64",), {})
    assert call_type(operator, None, ("int64",), {}) is not first
    options = _options(Flags())
    with ConfigStack().enter(options):
        own = call_type(operator, None, ("int64",), {})
        assert call_type(operator, None, ["int64"], {}) is own is not first
        inner = call_type(operator, None, ("int64",), {"by": 1})
    with ConfigStack().enter(options.copy()):
        other = call_type(operator, None, ("int64",), {"by": 1})
    with ConfigStack().enter(options.copy()):
        assert call_type(operator, None, ("int64",), {"by": 1}) is other is not inner
    assert len(asked) == 5


@compiled
def factorial(n: int) -> int:
    if n <= 1:
        return 1
    return n * factorial(n - 1)


@compiled
def factorials(n: int) -> int:
    return factorial(n) + factorial(n - 1)


def test_a_kernel_can_call_itself() -> None:
    assert factorial(5) == 120
    assert factorials(5) == 144


def test_a_kernel_survives_pickling() -> None:
    again = pickle.loads(pickle.dumps(bent))  # noqa: S301 - just made
    assert isinstance(again, Kernel)
    assert numba_of(again)(3.0) == bent(3.0)


@compiled
def halves(values: Floats) -> tuple[Floats, Floats]:
    return values[::2], values[1::2]


@allocating
def taken(values: Floats) -> float:
    return float(halves(values)[0][0])


def test_a_kernel_that_counts_views_takes_none_from_one_that_does_not() -> None:
    """It would free memory that is in use."""
    with pytest.raises(TypingError, match="halves returns an array uncounted"):
        taken(np.ones(4))
