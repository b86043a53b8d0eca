"""Find the pictures that the textures of a glTF file name."""

import numpy as np
from jaxtyping import UInt8

from ..._core.gltf import Document
from ..._core.json_fields import Fields, extension, text, whole
from ..._core.words import reason
from ._gltf_accessors import view_bytes
from ._pictures import Decoder

_FORMATS = ("PNG", "JPEG", "WEBP")
# Other places where a texture may name its picture, and whether that is decoded here.
_EXTENSIONS = {
    "EXT_texture_webp": True,
    "KHR_texture_basisu": False,
    "EXT_texture_avif": False,
    "MSFT_texture_dds": False,
}


class Pictures:
    """Reads the pictures that textures name, each once, as 8-bit RGBA.

    A picture that cannot be read is no reason to refuse the shape: `note_unread` says so.
    """

    def __init__(self, document: Document):
        self._document = document
        self._read: dict[int | str, UInt8[np.ndarray, "h w 4"] | None] = {}
        self._decoder = Decoder(_FORMATS)
        self._unread: list[str] = []

    def note_unread(self) -> None:
        """Note how many textures could not be read, and why the first one could not."""
        if self._unread:
            self._document.note(f"textures not read (first: {self._unread[0]})", len(self._unread))

    def read(self, texture: Fields, owner: str) -> UInt8[np.ndarray, "h w 4"] | None:
        """Decode the picture of a texture, None where that cannot be."""
        number, unread = None, "without a picture"
        if texture.get("source") is not None:
            number = whole(texture, "source", owner)
        for name, decoded in _EXTENSIONS.items():
            fields = extension(texture, name, owner)
            if fields is None:
                continue
            if decoded:
                number = whole(fields, "source", owner)
            else:
                unread = f"with {name} only"
        if number is None:
            self._unread.append(f"{owner} is {unread}")
            return None
        image = self._document.item("images", number, owner)
        name = f"image {number}"
        where = text(image, "uri", name)
        key = whole(image, "bufferView", name) if where is None else where
        if key not in self._read:
            try:
                data = (
                    self._document.resource(key, name)
                    if isinstance(key, str)
                    else bytes(view_bytes(self._document, key, name)[0])
                )
                self._read[key] = self._decode(data, name)
            except ValueError as error:
                self._unread.append(str(error))
                self._read[key] = None
        return self._read[key]

    def _decode(self, data: bytes, owner: str) -> UInt8[np.ndarray, "h w 4"]:
        from PIL import UnidentifiedImageError

        try:
            return self._decoder.decode(data, self._document.size)
        except UnidentifiedImageError:
            kind = "KTX2" if data[1:7] == b"KTX 20" else "neither PNG, JPEG nor WebP"
            raise ValueError(f"{owner} cannot be decoded: it is {kind}") from None
        except Exception as error:  # decoders may raise anything where a picture is damaged
            raise ValueError(f"{owner} cannot be decoded: {reason(error)}") from None
