"""Whether bytes are a picture, looked at before trimesh reads them."""

import io


def check_picture(data: bytes) -> None:
    """Checks that a file is a picture of a sensible size: trimesh drops without a word what is none.

    Raises:
        OSError: it is none.
    """
    from PIL import Image

    try:
        Image.open(io.BytesIO(data)).close()
    except Image.UnidentifiedImageError:
        raise OSError("it is no picture that can be read") from None
    except (Image.DecompressionBombError, ValueError, SyntaxError) as error:
        raise OSError(str(error)) from None
