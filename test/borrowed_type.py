"""
A message type that is not installed, made of one that is: for raw messages over real DDS.

What goes over the wire are bytes and the type's name. Both are those of the type that is stood in
for; only what would pack and unpack them is another type's, and nothing asks for that.
"""

import ctypes
from typing import Any

_FASTRTPS = b'rosidl_typesupport_fastrtps_c'
_FIND = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)


class _TypeSupport(ctypes.Structure):
    """``rosidl_message_type_support_t`` of Jazzy."""

    _fields_ = [('identifier', ctypes.c_char_p), ('data', ctypes.c_void_p),
                *((name, ctypes.c_void_p) for name in ('find', 'hash', 'description', 'sources'))]


class _Callbacks(ctypes.Structure):
    """``message_type_support_callbacks_t``: the name of the type, and six functions."""

    _fields_ = [('namespace', ctypes.c_char_p), ('name', ctypes.c_char_p),
                *((f'function{i}', ctypes.c_void_p) for i in range(6))]


def borrowed_type(package: str, name: str, lender: Any) -> Any:
    """Return a type ``package/msg/name`` that packs like another one; for raw messages only."""
    kind = type(lender)
    kind.__import_type_support__()
    api = ctypes.pythonapi
    api.PyCapsule_GetName.restype, api.PyCapsule_GetPointer.restype = (
        ctypes.c_char_p, ctypes.c_void_p)
    api.PyCapsule_New.restype = ctypes.py_object
    capsule = ctypes.py_object(kind._TYPE_SUPPORT)
    label = api.PyCapsule_GetName(capsule)
    lent = _TypeSupport.from_address(api.PyCapsule_GetPointer(capsule, label))
    find = _FIND(lent.find)
    made, callbacks = _TypeSupport(), _Callbacks()
    at = find(ctypes.addressof(lent), _FASTRTPS)
    ctypes.memmove(ctypes.addressof(made), at, ctypes.sizeof(made))
    ctypes.memmove(ctypes.addressof(callbacks), made.data, ctypes.sizeof(callbacks))
    callbacks.namespace, callbacks.name = f'{package}::msg'.encode(), name.encode()
    found = _FIND(lambda _, wanted: ctypes.addressof(made) if wanted == _FASTRTPS
                  else find(ctypes.addressof(lent), wanted))
    made.data, made.find = ctypes.addressof(callbacks), ctypes.cast(found, ctypes.c_void_p).value
    kept = made, callbacks, found, label
    support = api.PyCapsule_New(
        ctypes.c_void_p(ctypes.addressof(made)), ctypes.c_char_p(label), None)
    functions = {each: getattr(kind, each) for each in (
        '_CREATE_ROS_MESSAGE', '_DESTROY_ROS_MESSAGE', '_CONVERT_FROM_PY', '_CONVERT_TO_PY')}
    meta = type(f'Metaclass_{name}', (type,), {
        **functions, '_TYPE_SUPPORT': support, 'kept': kept,
        '__import_type_support__': classmethod(lambda cls: None)})
    return meta(name, (), {'__slots__': ()})
