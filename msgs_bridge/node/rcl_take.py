"""
Taking messages from the middleware without holding Python up.

rclpy copies a message while it holds Python's lock: 60 MB for a tenth of a second, in which no
other thread does anything. The function of ROS below it, called through ctypes, does not.
"""

import ctypes
from functools import cache
from typing import Any, Final

#: What a call returns that has gone well.
_OK: Final = 0


class _Allocator(ctypes.Structure):
    """Four functions and their state: `rcutils_allocator_t`."""

    _fields_ = [(name, ctypes.c_void_p) for name in (
        'allocate', 'deallocate', 'reallocate', 'zero_allocate', 'state')]


class _Bytes(ctypes.Structure):
    """A message as bytes: `rcutils_uint8_array_t`."""

    _fields_ = [
        ('buffer', ctypes.c_void_p), ('length', ctypes.c_size_t), ('capacity', ctypes.c_size_t),
        ('allocator', _Allocator)]


class _About(ctypes.Structure):
    """What is known about a message: the beginning of `rmw_message_info_t`, and room for more."""

    _fields_ = [
        ('sent', ctypes.c_int64), ('received', ctypes.c_int64), ('number', ctypes.c_uint64),
        ('rest', ctypes.c_uint8 * 232)]


@cache
def _ros() -> tuple[Any, Any]:
    """Return the libraries of ROS that rclpy has loaded already."""
    rcl, rcutils = ctypes.CDLL('librcl.so'), ctypes.CDLL('librcutils.so')
    rcl.rcl_take_serialized_message.argtypes = [
        ctypes.c_void_p, ctypes.POINTER(_Bytes), ctypes.POINTER(_About),
        ctypes.c_void_p]
    rcutils.rcutils_get_default_allocator.restype = _Allocator
    rcutils.rcutils_uint8_array_init.argtypes = [
        ctypes.POINTER(_Bytes), ctypes.c_size_t, ctypes.POINTER(_Allocator)]
    rcutils.rcutils_uint8_array_fini.argtypes = [ctypes.POINTER(_Bytes)]
    return rcl, rcutils


class RclTaker:
    """Takes messages of raw subscriptions; for one thread."""

    def __init__(self) -> None:
        """Start with a small buffer."""
        self._rcl, self._rcutils = _ros()
        self._allocator = self._rcutils.rcutils_get_default_allocator()
        self._bytes, self._about = _Bytes(), _About()
        self._begin()

    def _begin(self) -> None:
        if self._rcutils.rcutils_uint8_array_init(
                ctypes.byref(self._bytes), 0, ctypes.byref(self._allocator)) != _OK:
            raise MemoryError

    def take(self, subscription: int, most: int) -> bytes | int | None:
        """
        Take the next message.

        Parameters
        ----------
        subscription : int
            What the handle of an rclpy subscription points to.
        most : int
            So many bytes at most are made Python's own.

        Returns
        -------
        bytes or int or None
            The message; how many bytes it had if those were more; None if there is none.

        """
        if self._rcl.rcl_take_serialized_message(
                subscription, ctypes.byref(self._bytes), ctypes.byref(self._about),
                None) != _OK:
            return None
        size = int(self._bytes.length)
        if size <= most:
            return ctypes.string_at(self._bytes.buffer, size)
        self.give_back()
        return size

    def lend(self, subscription: int) -> memoryview | None:
        """
        Take the next message, of any length, and lend its bytes where they lie.

        They must not be looked at any more once `give_back` has been called.

        Parameters
        ----------
        subscription : int
            What the handle of an rclpy subscription points to.

        """
        if self._rcl.rcl_take_serialized_message(
                subscription, ctypes.byref(self._bytes), ctypes.byref(self._about),
                None) != _OK:
            return None
        lent = (ctypes.c_uint8 * int(self._bytes.length)).from_address(self._bytes.buffer or 0)
        return memoryview(lent).cast('B')

    def give_back(self) -> None:
        """Give the memory back of what was lent."""
        self.close()
        self._begin()

    @property
    def number(self) -> int:
        """Return the number that its publisher gave the last message; 0 where there are none."""
        return int(self._about.number)

    def close(self) -> None:
        """Give the memory back."""
        self._rcutils.rcutils_uint8_array_fini(ctypes.byref(self._bytes))
