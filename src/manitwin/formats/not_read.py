"""Kinds of files that are not read, by the suffixes of their names, and what to do with each."""

from __future__ import annotations

HEIC_NOT_READ = "HEIC is not read; convert it to PNG or JPEG"
"""Its only free decoder comes in wheels that bundle an encoder under the GPL."""

_IMPORT = "an asset description; manitwin import reads it with its meshes"
_CAMERA_RAW = "camera raw is not read; develop it to PNG or JPEG"
_EXPORT = "this mesh format is not read; export it as glTF 2.0 or OBJ"
_VIDEO = "a video; give a photo"
_IMAGE = "this image format is not read as a photo; convert it to PNG or JPEG"
_ARCHIVE = "an archive; unpack it"
NOT_READ = {
    **dict.fromkeys((".heic", ".heif"), HEIC_NOT_READ),
    **dict.fromkeys((".urdf", ".sdf", ".xacro", ".usd", ".usda", ".usdc"), _IMPORT),
    **dict.fromkeys((".dng", ".nef", ".cr2", ".cr3", ".arw", ".orf", ".rw2", ".raf", ".pef"), _CAMERA_RAW),
    **dict.fromkeys((".fbx", ".blend", ".3ds", ".max", ".step", ".stp", ".iges", ".igs", ".3mf", ".off", ".x3d"), _EXPORT),
    **dict.fromkeys((".abc", ".wrl", ".ma", ".mb", ".c4d", ".skp", ".drc", ".vrm", ".fcstd", ".sldprt"), _EXPORT),
    **dict.fromkeys((".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v"), _VIDEO),
    **dict.fromkeys((".tga", ".dds", ".exr", ".hdr", ".psd", ".svg", ".jxl", ".jp2", ".ktx", ".ktx2", ".ico"), _IMAGE),
    **dict.fromkeys((".zip", ".tar", ".gz", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst"), _ARCHIVE),
}  # fmt: skip
