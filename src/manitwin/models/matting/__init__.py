"""Photo matting: separate the object in a photo from its background, with built-in models that need no download."""

from manitwin.models.matting.matte import Matte, matte_photo

__all__ = ["Matte", "matte_photo"]
