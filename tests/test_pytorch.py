"""The blocks of `docs/how-to/use-from-pytorch.md` and what it says of them, where torch is."""

import re
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics, transfer

torch = pytest.importorskip("torch", reason="torch is not installed: its page is not tried")

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "use-from-pytorch.md"


@pytest.fixture(scope="module")
def page() -> dict:
    """What the first two blocks define: `to_jax`, `to_torch`, `torch_function`."""
    text, names = PAGE.read_text("utf-8"), {}
    for block in re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)[:2]:
        exec(block, names)
    return names


@pytest.fixture(scope="module")
def baked():
    points = jnp.asarray(np.random.default_rng(0).normal(size=(5, 3)))
    return transfer.unshadowed(points, points, 1)


def test_memory_is_shared_where_the_page_says(page):
    to_jax, to_torch = page["to_jax"], page["to_torch"]
    for kind in (torch.float32, torch.float16, torch.bfloat16, torch.int32, torch.float64):
        tensor = torch.ones(64, dtype=kind)
        array = to_jax(tensor)
        assert array.unsafe_buffer_pointer() == tensor.data_ptr()
        assert str(array.dtype) == str(tensor.dtype).split(".")[1]
        back = to_torch(array)
        assert back.data_ptr() == tensor.data_ptr()
        assert back.dtype == kind
    single = torch.ones(64)
    assert to_jax(single[16:]).unsafe_buffer_pointer() == single[16:].data_ptr()
    assert to_jax(single[1:]).unsafe_buffer_pointer() != single[1:].data_ptr()
    turned = torch.arange(12.0).reshape(3, 4).T
    np.testing.assert_array_equal(to_jax(turned), turned.numpy())
    assert to_jax(turned).unsafe_buffer_pointer() != turned.data_ptr()


def test_doubles_become_single_without_x64(page):
    with jax.enable_x64(False):
        assert page["to_jax"](torch.ones(3, dtype=torch.float64)).dtype == jnp.float32
        assert page["to_jax"](torch.ones(3, dtype=torch.int64)).dtype == jnp.int32


def test_a_result_is_waited_for(page):
    large = jnp.asarray(np.random.default_rng(0).normal(size=(600, 600)))
    product = jax.jit(lambda a: jnp.linalg.matrix_power(a / 25, 6))(large)
    got = page["to_torch"](product).clone()
    np.testing.assert_array_equal(got.numpy(), product)


def test_gradients_agree_with_finite_differences(page, baked):
    """`torch.autograd.gradcheck` in float64, of one light and of a batch."""
    shade = page["torch_function"](
        lambda baked, light, albedo: transfer.shade_diffuse(light, baked, albedo), baked
    )
    generator = torch.Generator().manual_seed(0)
    light = torch.rand(3, 4, dtype=torch.float64, generator=generator, requires_grad=True)
    count = baked.num_points
    albedo = torch.rand(count, 3, dtype=torch.float64, generator=generator, requires_grad=True)
    assert torch.autograd.gradcheck(shade, (light, albedo), atol=1e-8, rtol=0)
    batch = torch.stack([light.detach(), 2 * light.detach()])[:, None]
    values = shade(batch.requires_grad_(True), albedo)
    np.testing.assert_allclose(values[1].detach(), 2 * values[0].detach(), rtol=1e-14, atol=0)
    with torch.no_grad():
        assert not shade(light, albedo).requires_grad


def test_gradients_keep_their_dtype_and_are_of_first_order(page):
    evaluate = page["torch_function"](lambda d: harmonics.evaluate(d, 2))
    directions = torch.tensor([[0.6, 0.0, 0.8]], requires_grad=True)
    (gradient,) = torch.autograd.grad(evaluate(directions).sum(), directions, create_graph=True)
    assert gradient.dtype == torch.float32
    expected = jax.grad(lambda d: harmonics.evaluate(d, 2).sum())(jnp.float32([[0.6, 0.0, 0.8]]))
    np.testing.assert_allclose(gradient.detach(), expected, rtol=0, atol=1e-6)
    with pytest.raises(RuntimeError, match="does not require grad"):
        gradient.sum().backward()
