"""Networks are read bounded, put in order, and refused in one line."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.formats.onnx_file import parse_onnx
from tiny_networks import field, tensor_info, tiny_network


def test_nodes_are_put_in_order_and_what_no_output_needs_is_left_out() -> None:
    read = parse_onnx(tiny_network(), "tiny.onnx", UsageError)
    assert [(tensor.name, tensor.shape) for tensor in read.inputs] == [("picture", (1, 3, 64, 64))]
    assert read.outputs[0].name == "mask"
    assert read.content.index(b"Conv") < read.content.index(b"Sigmoid")
    assert read.content.count(b"Sigmoid") == 1
    net = cv2.dnn.readNetFromONNX(np.frombuffer(read.content, np.uint8))
    net.setInput(np.ones((1, 3, 64, 64), np.float32))
    assert np.allclose(net.forward(), 0.5)


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"", "no graph"),
        (b"\x7fELF" + bytes(60), "field of kind"),
        (tiny_network()[:-40], "too early"),
        (tiny_network(outside=True), "another file"),
        (tiny_network(loop=True), "wait for each other"),
        (field(7, field(11, tensor_info("x", (1, 3, 8, 8)))), "no nodes"),
        (b"\xff" * 40, "number without end"),
    ],
)
def test_what_is_no_network_is_refused_in_one_line(content: bytes, cause: str) -> None:
    with pytest.raises(UsageError, match=cause) as caught:
        parse_onnx(content, "net.onnx", UsageError)
    assert str(caught.value).startswith("net.onnx: ") and "\n" not in str(caught.value)


def test_cut_and_flipped_networks_end_in_an_answer_or_one_line() -> None:
    whole = tiny_network()
    rng = np.random.default_rng(0)
    for _ in range(300):
        broken = bytearray(whole)
        for at in rng.integers(len(whole), size=3):
            broken[at] = int(rng.integers(256))
        try:
            parse_onnx(bytes(broken), "net.onnx", UsageError)
        except UsageError as error:
            assert "\n" not in str(error)
