"""The image of a map: which format it is, how large, and how bright and opaque each pixel is."""

from dataclasses import dataclass
import os
from pathlib import Path
import re
from typing import Any, BinaryIO, Final, TypeAlias
import warnings

import numpy as np
import numpy.typing as npt
from PIL import Image
from PIL.BmpImagePlugin import BmpImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.PpmImagePlugin import PpmImageFile

from world_maps.deep_colour import deep_channels
from world_maps.errors import check_size, open_map, WorldError

Bytes: TypeAlias = npt.NDArray[np.uint8]

#: The content tells the format, whatever the name says. Pillow's own look-up is not used: it
#: refuses what is large before it can be said how large that is.
_FORMATS: Final[tuple[tuple[bytes, str, Any], ...]] = (
    (b'\x89PNG\r\n\x1a\n', 'PNG', PngImageFile),
    (b'\xff\xd8\xff', 'JPEG', JpegImageFile),
    (b'BM', 'BMP', BmpImageFile),
    *((b'P%d' % kind, 'PNM', PpmImageFile) for kind in range(1, 7)),
)
_OTHERS: Final = (
    (b'GIF8', 'GIF'), (b'II*\0', 'TIFF'), (b'MM\0*', 'TIFF'), (b'RIFF', 'WebP'), (b'%PDF', 'PDF'),
    (b'<svg', 'SVG'), (b'<?xml', 'SVG'), (b'version https://git-lfs', 'Git LFS'),
)
#: Most bytes of a PNM's header with its comments, and of a number in plain text with its blanks.
_MOST_HEADER, _MOST_NUMBER = 64 * 1024, 12
_COMMENT: Final = re.compile(rb'#[^\r\n]*')
#: How far behind the pixels is looked for something other than blanks.
_MAX_TAIL: Final = 1024
_BLANKS: Final = np.frombuffer(b' \t\n\r\v\f', np.uint8)
#: What Pillow raises for broken files, beside its own errors (which are OSErrors).
_BROKEN: Final = (OSError, ValueError, SyntaxError, EOFError, OverflowError, TypeError, IndexError,
                  MemoryError, Image.DecompressionBombError, Warning)
#: Rec. 601 luma in thousandths, as GraphicsMagick turns colours to grey.
_LUMA: Final = (299, 587, 114)
#: Pillow makes 8 bits of the greys of 2 and 4, but not of the one that is see-through.
_STEPS: Final = {'L;2': 85, 'L;4': 17}
#: 16-bit pixels are 257 times as large as 8-bit ones.
_WIDE: Final = 257


@dataclass(frozen=True, eq=False)
class Pixels:
    """
    An image as map_server sees it; first row at the top of the image.

    Parameters
    ----------
    grey, alpha : ndarray of uint8, shape (n_rows, n_cols)
        Brightness, and 255 where nothing shines through.
    kind : str
        Format of the content: PNG, JPEG, BMP or PNM.

    """

    grey: Bytes
    alpha: Bytes
    kind: str


def read_pixels(path: Path) -> Pixels:
    """
    Read an image of any name; its content says which format it is.

    Raises
    ------
    WorldError
        If the file is no image, is too large (its header says so, nothing is unpacked), is cut
        off or longer than its header says.

    """
    with open_map(path) as file:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('error')
                kind, image_class = _format_of(path, file)
                if kind == 'PNM':
                    _check_header(path, file)
                with image_class(file) as image:
                    check_size(path, image.height, image.width)
                    _check_length(path, file, image)
                    return Pixels(*_grey_and_alpha(path, file, image), kind)
        except WorldError:
            raise
        except _BROKEN as error:
            raise WorldError(path, 'is no complete image (PGM, PNG, BMP or JPEG), write it '
                                   'anew') from error


def jpeg_notes(path: Path, kind: str) -> list[str]:
    """Return what a user should know of an image that is a JPEG."""
    if kind != 'JPEG':
        return []
    note = (f'{path}: is a JPEG, which blurs edges: walls may be a pixel thicker or thinner '
            f'than drawn, better save maps as PNG')
    return [note]


def _format_of(path: Path, file: BinaryIO) -> tuple[str, Any]:
    start = file.read(32)
    file.seek(0)
    for signature, kind, image_class in _FORMATS:
        if start.startswith(signature):
            return kind, image_class
    for signature, kind in _OTHERS:
        if start.lower().startswith(signature.lower()):
            raise WorldError(path, f'is a {kind} file by its content, save it as PNG')
    raise WorldError(path, 'is no image (PGM, PNG, BMP or JPEG) by its content, check the name')


def _check_header(path: Path, file: BinaryIO) -> None:
    """Refuse a header that does not end: Pillow reads comments letter by letter."""
    head = file.read(_MOST_HEADER)
    is_longer = bool(file.read(1))
    file.seek(0)
    if is_longer and len(_COMMENT.sub(b'', head).split(maxsplit=4)) < 4:
        raise WorldError(path, f'has a header of more than {_MOST_HEADER} bytes, take the '
                               f'comments out of it')


def _check_plain_size(path: Path, file: BinaryIO, n_numbers: int) -> None:
    """Refuse an image in plain text with much more text than pixels."""
    most = n_numbers * _MOST_NUMBER + _MOST_HEADER
    if os.fstat(file.fileno()).st_size > most:
        raise WorldError(path, f'has more than {most} bytes for {n_numbers} numbers, take the '
                               f'comments out of it or save it as PNG')


def _check_length(path: Path, file: BinaryIO, image: Image.Image) -> None:
    """Refuse a PGM with more or fewer pixels than its header says."""
    file.seek(0)
    kind = file.read(2)
    if kind in (b'P1', b'P2', b'P3'):
        _check_plain_size(path, file, image.width * image.height * (3 if kind == b'P3' else 1))
    if kind == b'P2':
        _check_numbers(path, file.read(), image.width * image.height)
    if kind != b'P5':
        return
    first = getattr(image, 'tile')[0][2]  # noqa: B009 - Pillow's types do not know it
    n_bytes = image.width * image.height * (1 if image.mode == 'L' else 2)
    n_there = file.seek(0, os.SEEK_END) - first
    file.seek(first + n_bytes)
    if n_there < n_bytes or file.read(_MAX_TAIL).strip():
        raise WorldError(path, f'holds {n_there} bytes of pixels, its header says '
                               f'{image.width} x {image.height}: {n_bytes}')


def _check_numbers(path: Path, text: bytes, n_pixels: int) -> None:
    """Refuse a PGM in plain text with more or fewer numbers than pixels."""
    is_blank = np.isin(np.frombuffer(_COMMENT.sub(b'', text), np.uint8), _BLANKS)
    # Width, height and the value of white stand before the pixels.
    n_there = int((is_blank[:-1] & ~is_blank[1:]).sum()) - 3
    if n_there != n_pixels:
        raise WorldError(path, f'holds {n_there} pixels, its header says {n_pixels}')


def _grey_and_alpha(
    path: Path, file: BinaryIO, image: Image.Image,
) -> tuple[Bytes, Bytes]:
    if image.mode in ('F', 'CMYK'):
        raise WorldError(path, f'has pixels of the kind {image.mode}, save it as 8-bit grey')
    deep = deep_channels(file, image)
    if deep is not None:
        alpha = deep[:, :, 3] if deep.shape[2] == 4 else np.full(deep.shape[:2], _WIDE * 255)
        return _as_bytes(_luma(deep) // _WIDE), _as_bytes(alpha // _WIDE)
    white = _white(image)
    if image.mode in ('I', 'I;16', 'I;16B'):
        values = np.asarray(image).astype(np.int64)
        seen_through = image.info.get('transparency', -1)
        return _as_bytes(values // _WIDE), _as_bytes(np.where(values == seen_through, 0, 255))
    if image.mode in ('1', 'L') and 'transparency' not in image.info:
        # The luma of a grey is that grey: what most maps are is not made four times as large.
        grey = np.asarray(image.convert('L'))
        return _as_bytes(_wide(grey, white) // _WIDE), np.full_like(grey, 255)
    steps = _STEPS.get(getattr(image, 'tile')[0][3])  # noqa: B009 - Pillow's types lack it
    if steps and isinstance(image.info.get('transparency'), int):
        image.info['transparency'] *= steps
    if image.mode == 'RGB':
        image.info.pop('transparency', None)  # one colour that is see-through: not for map_server
    pixels = np.asarray(image.convert('RGBA'))
    return _as_bytes(_luma(_wide(pixels, white)) // _WIDE), _as_bytes(pixels[:, :, 3])


def _luma(wide: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return how bright colours of 16 bits are, in as many."""
    weighed = [weight * wide[:, :, channel] for channel, weight in enumerate(_LUMA)]
    return np.asarray((np.sum(weighed, axis=0) + 500) // 1000, dtype=np.int32)


def _white(image: Image.Image) -> int:
    """Return the value that a PNM file gives to white, 255 for every other image."""
    arguments = getattr(image, 'tile')[0][3]  # noqa: B009 - Pillow's types do not know it
    if isinstance(image, PpmImageFile) and isinstance(arguments, tuple):
        return int(arguments[-1])
    return 255


def _wide(values: Bytes, white: int) -> npt.NDArray[np.int32]:
    """Return pixels as 16 bits; Pillow has rounded those of another white to 8."""
    wide = values.astype(np.int32)
    if white >= 255:
        return wide * _WIDE
    steps = (wide * white * 2 + 255) // 510
    return (steps * 65535 * 2 + white) // (2 * white)


def _as_bytes(values: npt.NDArray[Any]) -> Bytes:
    return values.astype(np.uint8)
