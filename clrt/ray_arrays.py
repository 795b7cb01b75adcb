"""Arrays of rays as a caller gives them: checked, broadcast, and laid out as kernels read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.errors import ClrtError, RayError

_LARGEST_INTEGER = 2**53  #: beyond it, not every integer is a float64
_SHARED_BIT = 4


def numbers(values: ArrayLike, name: str, error: type[ClrtError] = RayError) -> NDArray[Any]:
    """`values` as an array of real numbers that float64 holds exactly, in the dtype and memory they came in.

    Accepted: float16, float32, float64, integers up to 2^53, in any byte order, strides or nesting; whatever has `__array__`.
    Raises `error`, naming the argument, for all else: longdouble would lose digits, masked elements their mask, objects who knows what.
    """
    if isinstance(values, np.ma.MaskedArray):
        masked = int(np.count_nonzero(np.ma.getmaskarray(values)))
        if masked:
            raise error(f"{name}: {masked} elements are masked; fill them (.filled) or leave their rows out")
        values = values.data
    try:
        array = np.asarray(values)
    except (ValueError, TypeError, RuntimeError) as cause:
        raise error(f"{name}: not a rectangular array of numbers: {cause}") from cause
    if array.dtype.kind == "f" and array.dtype.itemsize > 8:
        raise error(f"{name}: {array.dtype} numbers would lose digits in float64; round them yourself: .astype(np.float64)")
    if array.dtype.kind not in "fiu":
        found = "Python objects (a missing value, or rows of unequal length?)" if array.dtype.kind == "O" else f"{array.dtype} values"
        raise error(f"{name}: expected real numbers, float32 or float64, found {found}")
    if array.dtype.kind in "iu" and array.size and (int(array.max()) > _LARGEST_INTEGER or int(array.min()) < -_LARGEST_INTEGER):
        raise error(f"{name}: integers beyond 2^53 are not exact in float64; convert them yourself: .astype(np.float64)")
    return array


@dataclass(frozen=True, eq=False)
class RayArrays:
    """n rays: origins, directions (n, 3), t_min, t_max (n,), each in the caller's dtype; `shape`: of the results, n in all."""

    origins: NDArray[Any]
    directions: NDArray[Any]
    t_min: NDArray[Any]
    t_max: NDArray[Any]
    shape: tuple[int, ...]

    @classmethod
    def of(cls, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> RayArrays:
        """Checks and broadcasts. Raises RayError naming the argument."""
        start, along = _vectors(origins, "origins"), _vectors(directions, "directions")
        try:
            shape = np.broadcast_shapes(start.shape, along.shape)[:-1]
        except ValueError:
            raise RayError(
                f"origins and directions: shapes {start.shape} and {along.shape} do not go together; give as many of both, or one of either"
            ) from None
        low, high = _limits(t_min, "t_min", shape), _limits(t_max, "t_max", shape)
        return cls(_flat(start, (*shape, 3)).reshape(-1, 3), _flat(along, (*shape, 3)).reshape(-1, 3), low, high, shape)

    def __len__(self) -> int:
        return len(self.t_min)

    def columns(self, part: slice) -> tuple[list[NDArray[Any]], int]:
        """Origins, directions, t_min, t_max of the rays `part` as kernels read them, and the bits that say how (given.cl).

        float32 or float64, C order; one element where it serves all rays. No copy of what is in memory so already.
        """
        arrays, kinds = [], 0
        for place, values in enumerate((self.origins, self.directions, self.t_min, self.t_max)):
            shared = len(values) > 0 and values.strides[0] == 0
            chosen = values[:1] if shared else values[part]
            real = np.float32 if chosen.dtype == np.float32 else np.float64
            arrays.append(np.require(chosen, real, ["C", "A"]))
            kinds |= (real == np.float32) << place | shared << (_SHARED_BIT + place)
        return arrays, kinds


def _vectors(values: ArrayLike, name: str) -> NDArray[Any]:
    """(..., 3); one vector counts as (1, 3), an empty list as (0, 3)."""
    array = numbers(values, name)
    if array.shape == (0,):
        return array.reshape(0, 3)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise RayError(f"{name}: expected an array of shape (n, 3), found {array.shape}")
    return array[None] if array.ndim == 1 else array


def _limits(values: ArrayLike, name: str, shape: tuple[int, ...]) -> NDArray[Any]:
    array = numbers(values, name)
    try:
        return _flat(array, shape).reshape(-1)
    except ValueError:
        raise RayError(f"{name}: expected a number or an array of shape {shape}, one a ray; found the shape {array.shape}") from None


def _flat(array: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    return array if array.shape == shape else np.broadcast_to(array, shape)
