"""An FBX file of a box as text, written by hand."""

from __future__ import annotations

import numpy as np
import trimesh

DOCUMENT = """; FBX 7.4.0 project file
FBXHeaderExtension:  {{
    FBXHeaderVersion: 1003
    FBXVersion: 7400
}}
GlobalSettings:  {{
    Version: 1000
    Properties70:  {{
        P: "UpAxis", "int", "Integer", "",{up}
        P: "UpAxisSign", "int", "Integer", "",1
        P: "FrontAxis", "int", "Integer", "",{front}
        P: "FrontAxisSign", "int", "Integer", "",{sign}
        P: "CoordAxis", "int", "Integer", "",0
        P: "CoordAxisSign", "int", "Integer", "",1
        P: "UnitScaleFactor", "double", "Number", "",{unit_cm}
    }}
}}
Objects:  {{
    Geometry: 20, "Geometry::", "Mesh" {{
        Vertices: *{numbers} {{
            a: {places}
        }}
        PolygonVertexIndex: *{corners} {{
            a: {indices}
        }}
        GeometryVersion: 124
        LayerElementUV: 0 {{
            Version: 101
            Name: "map"
            MappingInformationType: "ByPolygonVertex"
            ReferenceInformationType: "Direct"
            UV: *{coordinates} {{
                a: {uv}
            }}
        }}
        LayerElementMaterial: 0 {{
            Version: 101
            Name: ""
            MappingInformationType: "AllSame"
            ReferenceInformationType: "IndexToDirect"
            Materials: *1 {{
                a: 0
            }}
        }}
        Layer: 0 {{
            Version: 100
            LayerElement:  {{
                Type: "LayerElementUV"
                TypedIndex: 0
            }}
            LayerElement:  {{
                Type: "LayerElementMaterial"
                TypedIndex: 0
            }}
        }}
    }}
    Model: 30, "Model::box", "Mesh" {{
        Version: 232
        Properties70:  {{
            P: "Lcl Translation", "Lcl Translation", "", "A",100,0,0
        }}
    }}
    Material: 40, "Material::paint", "" {{
        Version: 102
        ShadingModel: "lambert"
        Properties70:  {{
            P: "DiffuseColor", "Color", "", "A",1,0,0
        }}
    }}
{pictures}{more}}}
Connections:  {{
    C: "OO",30,0
    C: "OO",20,30
    C: "OO",40,30
    {connected}}}
"""


def fbx_box(
    size: tuple[float, float, float] = (10.0, 20.0, 30.0),
    *,
    unit_cm: float = 1.0,
    up: int = 1,
    texture: str | None = None,
    more: str = "",
) -> str:
    """Return an FBX 7.4 file of a box about the origin, red where it has no texture, moved by 100 units along its X.

    ``unit_cm`` is the length of its unit, ``up`` the number of its up axis (1: Y, 2: Z), ``texture`` the path of a picture,
    ``more`` further objects.
    """
    box = trimesh.creation.box(size)
    places = ",".join(f"{value:g}" for value in box.vertices.reshape(-1))
    corners = box.faces.copy()
    corners[:, 2] = -corners[:, 2] - 1  # the last corner of a polygon is told by its complement
    indices = ",".join(str(value) for value in corners.reshape(-1).tolist())
    count = 3 * len(box.faces)
    uv = ",".join(f"{value:g}" for value in np.tile([0.25, 0.75], count).tolist())
    pictures = "" if texture is None else _texture(texture)
    connected = "" if texture is None else 'C: "OP",50,40, "DiffuseColor"\n'
    front, sign = (2, 1) if up == 1 else (1, -1)
    return DOCUMENT.format(
        up=up,
        front=front,
        sign=sign,
        unit_cm=unit_cm,
        numbers=box.vertices.size,
        places=places,
        corners=count,
        indices=indices,
        coordinates=2 * count,
        uv=uv,
        pictures=pictures,
        more=more,
        connected=connected,
    )


def _texture(path: str) -> str:
    return f"""    Texture: 50, "Texture::picture", "" {{
        Type: "TextureVideoClip"
        Version: 202
        FileName: "{path}"
        RelativeFilename: "{path}"
    }}
"""
