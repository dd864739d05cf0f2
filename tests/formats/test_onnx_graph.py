"""A network written in memory gives what its layers say, read by OpenCV."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.formats.onnx_graph import OnnxGraph


def test_words_numbers_and_lists_of_a_node_are_read_as_they_were_written() -> None:
    graph = OnnxGraph((1, 1, 2, 2))
    doubled = graph.node("Mul", ["input", graph.weight("two", np.full((1, 1, 1, 1), 2.0))], "doubled")
    none = [graph.weight(name, np.zeros(0, np.float32)) for name in ("region", "scales")]
    sizes = graph.weight("sizes", np.array([1, 1, 4, 4]))
    how = {"mode": "nearest", "coordinate_transformation_mode": "asymmetric", "nearest_mode": "floor"}
    larger = graph.node("Resize", [doubled, *none, sizes], "larger", **how)
    pooled = graph.node("AveragePool", [larger], "pooled", kernel_shape=[2, 4], strides=[2, 4])
    net = cv2.dnn.readNetFromONNX(np.frombuffer(graph.to_bytes(pooled, (1, 1, 2, 1)), np.uint8))
    net.setInput(np.array([[[[1, 2], [3, 4]]]], np.float32))
    assert np.allclose(net.forward().ravel(), [3, 7])
