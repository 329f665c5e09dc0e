"""Colours of 16 bits, of which Pillow keeps eight: map_server weighs all sixteen."""

import re
from typing import Any, BinaryIO, Final, TypeAlias

import numpy as np
import numpy.typing as npt
from PIL import Image
from PIL.PngImagePlugin import PngImageFile
from PIL.PpmImagePlugin import PpmImageFile

Channels: TypeAlias = npt.NDArray[np.int32]

#: How Pillow unpacks a PNG of 16-bit colours, and how else the same bytes are unpacked so that
#: all of them are seen: the mode of the image, and that of the bytes, once or twice.
_PNG: Final = {'RGB;16B': ('RGB', ('RGB;16B', 'RGB;16L')),
               'RGBA;16B': ('RGBA', ('RGBA;16B', 'RGBA;16L')),
               'LA;16B': ('RGBA', ('RGBA',))}
_COMMENT: Final = re.compile(rb'#[^\r\n]*')
_WHITE: Final = 65535


def deep_channels(file: BinaryIO, image: Image.Image) -> Channels | None:
    """
    Return red, green, blue (and alpha) of an image of 16-bit colours; None for any other image.

    Parameters
    ----------
    file : BinaryIO
        Which the image was opened from.
    image : Image
        Nothing of its pixels was read.

    Returns
    -------
    ndarray of int32, shape (n_rows, n_cols, 3 or 4)
        0 to 65535.

    Raises
    ------
    ValueError, OSError
        If the file is cut off or broken.

    """
    arguments = getattr(image, 'tile')[0][3]  # noqa: B009 - Pillow's types do not know it
    if isinstance(image, PngImageFile) and arguments in _PNG:
        return _from_png(file, *_PNG[arguments])
    if isinstance(image, PpmImageFile) and image.mode == 'RGB' and isinstance(arguments, tuple):
        return _from_pnm(file, image, int(arguments[-1])) if arguments[-1] > 255 else None
    return None


def _from_png(file: BinaryIO, mode: str, raw_modes: tuple[str, ...]) -> Channels:
    parts = [_unpacked(file, mode, raw).astype(np.int32) for raw in raw_modes]
    if len(parts) == 2:
        return parts[0] * 256 + parts[1]
    (both,) = parts  # of grey and alpha, high and low byte each
    grey, alpha = (both[:, :, i] * 256 + both[:, :, i + 1] for i in (0, 2))
    return np.stack([grey, grey, grey, alpha], axis=2)


def _unpacked(file: BinaryIO, mode: str, raw: str) -> npt.NDArray[np.uint8]:
    file.seek(0)
    # Closing it would close the file, too.
    image: Any = PngImageFile(file)
    image._mode = mode
    image.tile = [image.tile[0]._replace(args=raw)]
    return np.asarray(image)


def _from_pnm(file: BinaryIO, image: Image.Image, white: int) -> Channels:
    n_numbers = image.width * image.height * 3
    file.seek(0)
    if file.read(2) == b'P3':
        text = _COMMENT.sub(b'', file.read())
        # Width, height and the value of white stand before the pixels.
        values = np.fromstring(text.decode('ascii'), dtype=np.int64, sep=' ')[3:]
    else:
        file.seek(getattr(image, 'tile')[0][2])  # noqa: B009 - Pillow's types do not know it
        values = np.frombuffer(file.read(2 * n_numbers), '>u2').astype(np.int64)
    if len(values) < n_numbers or (values < 0).any():
        raise ValueError('it is cut off')
    values = np.minimum(values[:n_numbers], white)
    wide = (values * (2 * _WHITE) + white) // (2 * white)
    return wide.astype(np.int32).reshape(image.height, image.width, 3)
