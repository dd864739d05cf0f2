"""A ball in glTF whose buffer views meshoptimizer has compressed.

The streams were made by meshoptimizer 0.22 (its Python package, 0.2.30a0) of ``trimesh.creation.icosphere(subdivisions=1,
radius=0.05)``: its places as 32-bit numbers as they are, and by the exponential filter with mantissas of 15 bits; its normals
by the octahedral one, 8 bits; its triangles, and the same indices as a sequence; and six unit quaternions of 12 bits.
"""

from __future__ import annotations

import base64
from typing import Any

STREAMS = {
    "places": (
        "oBUAwMDMMsvM3w8DzMzg3+BrBgUGMzMAAAUGBQYVAMDAzKtsa0oPA8zMSUpJoTo5OjMzAAA5Ojk6FQDAwMxSXFv6DwPMzPn6+UqxsrHz"
        "MzAA/02xsrH/FT/AzM////93ev+Gh////8SE//93h////3d6sSEgAP8VAMDAzJoyZQUPA8zMbGtsZXl6efMzMADgZXl6eeAVAMDAzECr"
        "ZzkPA8zMoqGiZ7KxsvMzMABJZ7KxskkVAMDAzK1SmE0PA8zMSUpJZ52enfMzMAD5Z52enfkVDH/A8P////93ev/PM/Mz/3mF/3l4////"
        "//zM8AB3eP////93FQDAwMzLmjJlAADMzHl0c3TzMzAAbN90c3RsFQDAwMxsQKtnAADMzLLr7OvzMzAAokrr7OuiFQDAwMxcrVJnDwPM"
        "zP///2KvsK/zMzAASfqvsK9JFQDMf8x6/////3d4CwJIyP7+8jIwAHmH/nkAAAAAAAAAAAAAAAAAAAAAAAAAAOdW17yaNi49AAAAAA=="
    ),
    "exponential": (
        "oB0/wMzPp6inVOM345Hb3NuRkdvc25HYAHEAcgBxADMzAADCcnFyHT/AzM/W1dZpVq1Yf/79/n1//v3+fVIAFAATABQAMzMAALkTFBMV"
        "JgAEhmGYAAAQAAAAFQDAwMwKBwgLDwPEhAwLDAeBISAAHQz/wPw3j6eop1Rmy3FPANfXAE8A12bLK9sryyvb///wAJFmyyvbK8sr25Ed"
        "DP/A/K0T1tXWaWbNFKYAUVMApgBRZs0X/hfNF/7///AAfWbNF/4XzRf+fRUEJgAQgSASEgSEgAAVAEDAwAoHDwPEhAgHCAnxITAADAkM"
        "FQDM/8zjN4+nqKdUZgMAzMzLK0WVRvMzMADXkUWVRtcVAMz/zFatE9bV1mlmAwDMzM0XLNIr8zMwAFF/LNIrURUABCYAAQAAgBAgAAAl"
        "AMBAzAcKCQkCzMwDBAMEiwQDBAgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAACrK/+2OKwDuAAAA8g=="
    ),
    "octahedral": (
        "oB8AxMPEYQCcAGJhZmKcAC9gX2Avf////35NAB4ATQAxAPMzMACwUh1OMq8fAADIADrEoAObYWJh/gR+AP8Af80AYwAwff8vn2GbHmD/"
        "//AAL4D/L59hmx5gLwAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAM9OfwA="
    ),
    "triangles": (
        "4f7//ySPT/4Uf27/Jn9P/yV/T/8l////JP///yP///4T////JP///yT+//4Tj27/KH9N/yV/Tv8lf0//Jf///hL///8j/v//I////hL/"
        "/v8l/0op/yozOh8vFQ4KIQgfARs0Bh8FLTYIHwcz7xM2/xUXNB8FJf8HRiu/LAEfKRv/DjwF/wY9MEH/LzQB/wI5IB8YOf8CHgr/CSku"
        "HwYl/yob/xwnKkEhHwEVJB8CGyYfASEqBh8FJ/8JNBdPGAIx/zkYMJ8vMh8BNf8QIK8fHh8CMf8DJAKvAQUx/xsuB/IHHwg1AHaHVmd4"
        "qYZliWiYAWkAAA=="
    ),
    "indices": (
        "0QCVAVNVZ3VfYRQLDV8/QQ8RKzETFT89BRMvMSUjK1UDBTsVKQNTVTEvN3ULDWctPQsSAREPW6QBDhAFWSEPngFALCouaAoMViA4CloN"
        "V1lzcVNVAgUDUxuUAQoMA2ERD5oBHRsRb2kDBXNBMS9DiAEyMG48FBJSXAwKPjgIDF5oNjhOVDo8ZmQEOi4wBggqKAIELjQCAiYoHBoq"
        "RAQCMhwYBEJEFBI2UAIERjAYAlZYEA5CYAoMWkAcCmJoLjBSWDI0ZmQEMj4wYF4mhQEDBW8NZQMINEA+Qg8FA18lPQVrSQUDT0URDz9N"
        "CxFHXQ8RX0ERD1t4HhAAAAAA"
    ),
    "quaternions": (
        "oAE/8AAA0prengcBP8AAAAoDBwkBP/AAAM5i2i6kAT/wAAALBgwPCgE/8AAA250PyeYBPzAAAAoGAwcBBfAAAAYDAAAAAAAAAAAAAAAA"
        "AAAAAAAAAAAAAAAAAMIBHALJ/f4H"
    ),
}


def stream(name: str) -> bytes:
    """Return one of STREAMS."""
    return base64.b64decode(STREAMS[name])


def compressed_document(places: str = "places", triangles: str = "triangles") -> dict[str, Any]:
    """Return a document of the ball, 42 vertices and 80 faces; what it needs is compressed and nowhere else."""
    names = (places, "octahedral", triangles)
    layouts = ((42, 12, "ATTRIBUTES"), (42, 4, "ATTRIBUTES"), (240, 2, triangles.upper()))
    views, data, start = [], b"", 0
    for name, (count, stride, mode) in zip(names, layouts, strict=True):
        told = {"buffer": 0, "byteOffset": len(data), "byteLength": len(stream(name)), "byteStride": stride}
        told |= {"count": count, "mode": mode}
        if name in ("exponential", "octahedral"):
            told["filter"] = name.upper()
        view = {"buffer": 1, "byteOffset": start, "byteLength": count * stride}
        views.append({**view, "extensions": {"EXT_meshopt_compression": told}})
        data, start = data + stream(name), start + count * stride
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 42, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5120, "count": 42, "type": "VEC3", "normalized": True},
        {"bufferView": 2, "componentType": 5123, "count": 240, "type": "SCALAR"},
    ]
    views[1]["byteStride"] = 4
    extension = "EXT_meshopt_compression"
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": [extension, "KHR_mesh_quantization"],
        "extensionsRequired": [extension, "KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {"byteLength": len(data), "uri": uri},
            {"byteLength": start, "extensions": {extension: {"fallback": True}}},
        ],
    }
