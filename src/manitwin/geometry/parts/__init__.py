"""Parts and named features of an object (handle, rim, tip) found from its shape by rules."""
