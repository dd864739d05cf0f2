"""Catalogues of twins for retrieval, classification and captioning: pictures, point clouds, captions and categories."""
