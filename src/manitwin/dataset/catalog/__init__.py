"""Catalogues: pictures, point clouds, captions and categories of twins, for retrieval, classification and captioning."""
