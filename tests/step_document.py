"""A STEP file (AP214) of a box, written by hand."""

from __future__ import annotations

import numpy as np

LENGTH_UNITS = {
    "mm": ("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))",),
    "m": ("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))",),
    "inch": (
        "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))",
        "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{0})",
        "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)",
        "(CONVERSION_BASED_UNIT('INCH',#{1})LENGTH_UNIT()NAMED_UNIT(#{2}))",
    ),
}
_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


class _Step:
    """Entities in the making; each is told by its number."""

    def __init__(self) -> None:
        self.entities: list[str] = []

    def add(self, entity: str) -> int:
        self.entities.append(entity)
        return len(self.entities)

    def names(self, numbers: list[int]) -> str:
        return ",".join(f"#{number}" for number in numbers)

    def direction(self, values: np.ndarray) -> int:
        x, y, z = (values / np.linalg.norm(values)).tolist()
        return self.add(f"DIRECTION('',({x:.6f},{y:.6f},{z:.6f}))")

    def text(self) -> str:
        lines = "\n".join(f"#{number}={entity};" for number, entity in enumerate(self.entities, 1))
        return (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
            "FILE_NAME('box','2026-01-01T00:00:00',(''),(''),'','','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\n"
            f"DATA;\n{lines}\nENDSEC;\nEND-ISO-10303-21;\n"
        )


def step_box(size: tuple[float, float, float], unit: str = "mm") -> str:
    """Return a STEP file of a box with a corner at the origin; ``unit`` is one of LENGTH_UNITS."""
    step = _Step()
    corners = [np.array([i, j, k]) * size for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    points = [step.add(f"CARTESIAN_POINT('',({x:.6f},{y:.6f},{z:.6f}))") for x, y, z in corners]
    vertices = [step.add(f"VERTEX_POINT('',#{point})") for point in points]
    edges: dict[tuple[int, int], int] = {}
    faces = [_face(step, face, corners, points, vertices, edges) for face in _FACES]
    shell = step.add(f"CLOSED_SHELL('',({step.names(faces)}))")
    solid = step.add(f"MANIFOLD_SOLID_BREP('',#{shell})")
    _product(step, solid, unit)
    return step.text()


def _face(
    step: _Step,
    face: tuple[int, ...],
    corners: list[np.ndarray],
    points: list[int],
    vertices: list[int],
    edges: dict[tuple[int, int], int],
) -> int:
    turned = []
    for first, last in zip(face, (*face[1:], face[0]), strict=True):
        key = min(first, last), max(first, last)
        if key not in edges:
            along = corners[key[1]] - corners[key[0]]
            vector = step.add(f"VECTOR('',#{step.direction(along)},{np.linalg.norm(along):.6f})")
            line = step.add(f"LINE('',#{points[key[0]]},#{vector})")
            edges[key] = step.add(f"EDGE_CURVE('',#{vertices[key[0]]},#{vertices[key[1]]},#{line},.T.)")
        turned.append(step.add(f"ORIENTED_EDGE('',*,*,#{edges[key]},{'.T.' if first < last else '.F.'})"))
    loop = step.add(f"EDGE_LOOP('',({step.names(turned)}))")
    bound = step.add(f"FACE_OUTER_BOUND('',#{loop},.T.)")
    side, other = corners[face[1]] - corners[face[0]], corners[face[2]] - corners[face[0]]
    normal, along_side = step.direction(np.cross(side, other)), step.direction(side)
    place = step.add(f"AXIS2_PLACEMENT_3D('',#{points[face[0]]},#{normal},#{along_side})")
    plane = step.add(f"PLANE('',#{place})")
    return step.add(f"ADVANCED_FACE('',(#{bound}),#{plane},.T.)")


def _product(step: _Step, solid: int, unit: str) -> None:
    numbers: list[int] = []
    for entity in LENGTH_UNITS[unit]:
        numbers.append(step.add(entity.format(*numbers)))
    angle = step.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = step.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    exact = step.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-05),#{numbers[-1]},'','')")
    context = step.add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{exact}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{numbers[-1]},#{angle},#{solid_angle}))REPRESENTATION_CONTEXT('',''))"
    )
    origin = step.add("CARTESIAN_POINT('',(0.,0.,0.))")
    axes = step.direction(np.array([0.0, 0, 1])), step.direction(np.array([1.0, 0, 0]))
    place = step.add(f"AXIS2_PLACEMENT_3D('',#{origin},#{axes[0]},#{axes[1]})")
    shape = step.add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{place},#{solid}),#{context})")
    application = step.add("APPLICATION_CONTEXT('automotive design')")
    mechanical = step.add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
    product = step.add(f"PRODUCT('box','box','',(#{mechanical}))")
    formation = step.add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
    design = step.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
    definition = step.add(f"PRODUCT_DEFINITION('design','',#{formation},#{design})")
    defined = step.add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
    step.add(f"SHAPE_DEFINITION_REPRESENTATION(#{defined},#{shape})")
