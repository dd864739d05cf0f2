"""Tell the object in a photo from its background, without weights."""

from manitwin.models.matting.matte import Matte, matte_photo

__all__ = ["Matte", "matte_photo"]
