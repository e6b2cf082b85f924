"""Rendering with OpenGL without a display (moderngl on EGL): the fast renderer, an optional extra."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from fba.errors import MissingDependencyError
from studio.render import shading
from studio.render.camera import Camera
from studio.render.drawable import ATTRIBUTES, Decal, Drawable, corner_attributes
from studio.render.protocol import RendererError, depth_range
from studio.render.shading import SAMPLES, UInt8, resolve

VERTEX_SHADER = """
#version 330
uniform mat4 matrix;
in vec3 place; in vec3 normal; in vec3 albedo; in float gloss; in vec3 rest;
out vec3 v_normal; out vec3 v_albedo;
out float v_gloss; out vec3 v_rest;
void main() {
  gl_Position = matrix * vec4(place, 1.0);
  v_normal = normal; v_albedo = albedo; v_gloss = gloss; v_rest = rest;
}
"""

FRAGMENT_SHADER = """
#version 330
in vec3 v_normal; in vec3 v_albedo;
in float v_gloss; in vec3 v_rest;
uniform float iris_angle; uniform vec3 iris_color;
uniform bool has_decal; uniform sampler2D decal;
uniform int quarters;
out vec4 color;
float soft_step(float radius, float at, float softness) {
  return smoothstep(at - softness, at + softness, radius);
}
vec3 paint_iris(vec3 white_albedo) {
  float cosine = v_rest.z / max(length(v_rest), 1e-12);
  float radius = sqrt(max(1.0 - cosine, 0.0) / (1.0 - cos(iris_angle)));
  float white = soft_step(radius, 1.0, EDGE);
  float black = 1.0 - soft_step(radius, PUPIL, EDGE);
  float ring = soft_step(radius, LIMBUS, 0.16);
  float tone = (1.15 - 0.35 * radius) * (1.0 - 0.62 * ring) * (1.0 - 0.97 * black);
  return white_albedo * white + iris_color * iris_color * tone * (1.0 - white);
}
float lambert(vec3 n, vec3 light, float wrap) { return max((dot(n, light) + wrap) / (1.0 + wrap), 0.0); }
bool sieved() {
  int row = SAMPLES - 1 - int(gl_FragCoord.y) % SAMPLES;
  int sample_number = int(gl_FragCoord.x) % SAMPLES + SAMPLES * row;
  return int[4](SIEVE)[sample_number] >= quarters;
}
vec3 tint_by_decal(vec3 albedo) {
  if (any(lessThan(v_rest.xy, vec2(0.0))) || any(greaterThanEqual(v_rest.xy, vec2(1.0)))) return albedo;
  vec3 texel = texture(decal, v_rest.xy).rgb;
  return albedo * texel * texel;
}
void main() {
  if (quarters < 4 && sieved()) discard;
  float facing = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = v_normal * facing / max(length(v_normal), 1e-12);
  vec3 albedo = iris_angle > 0.0 ? paint_iris(v_albedo) : v_albedo;
  if (has_decal) albedo = tint_by_decal(albedo);
  float edge = 1.0 - clamp(n.z, 0.0, 1.0);
  float rim = gl_FrontFacing ? lambert(n, RIM, 0.0) * edge * edge : 0.0;
  float shine = gl_FrontFacing ? pow(lambert(n, HALF, 0.0), 16.0) * v_gloss : 0.0;
  vec3 light = KEY_COLOR * lambert(n, KEY, KEY_WRAP) + FILL_COLOR * lambert(n, FILL, 0.0);
  light += mix(GROUND, SKY, 0.5 + 0.5 * n.y) + RIM_COLOR * rim;
  vec3 kept = gl_FrontFacing ? vec3(1.0) : INSIDE;
  color = vec4(sqrt(clamp(light * albedo * kept + shine, 0.0, 1.0)), 1.0);
}
"""

CONSTANTS = (
    *("KEY", "KEY_COLOR", "KEY_WRAP", "FILL", "FILL_COLOR", "RIM", "RIM_COLOR", "SKY", "GROUND", "HALF"),
    *("INSIDE", "PUPIL", "LIMBUS", "EDGE"),
)


def _fragment_source() -> str:
    """The shader with the studio's light written in."""
    lines = []
    for name in CONSTANTS:
        value = getattr(shading, name)
        is_vector = isinstance(value, tuple)
        text = "vec3(" + ", ".join(f"{v!r}" for v in value) + ")" if is_vector else repr(float(value))
        lines.append(f"#define {name} {text}")
    lines.append("#define SIEVE " + ", ".join(str(k) for k in shading.SIEVE))
    lines.append(f"#define SAMPLES {SAMPLES}")
    head, _, body = FRAGMENT_SHADER.partition("#version 330\n")
    return head + "#version 330\n" + "\n".join(lines) + "\n" + body


@cache
def _program() -> tuple[Any, Any]:
    """One context and program for the process: contexts are slow to make and few."""
    try:
        import moderngl
    except ImportError:
        raise MissingDependencyError("moderngl", "render", "the EGL renderer") from None
    try:
        # moderngl's own annotation of the backend (a dict) is wrong: it is passed on by name.
        settings: dict[str, Any] = {"backend": "egl"}
        context = moderngl.create_context(standalone=True, require=330, **settings)
        program = context.program(vertex_shader=VERTEX_SHADER, fragment_shader=_fragment_source().lstrip())
    except Exception as error:  # moderngl raises plain Exception and OSError alike when EGL is missing
        raise RendererError(
            f"OpenGL without a display does not work here ({error}); install libegl1 and libgl1-mesa-dri, "
            "or use the software renderer"
        ) from error
    return context, program


class EglRenderer:
    """See `studio.render.protocol.Renderer`.

    Raises
    ------
    MissingDependencyError
        If moderngl is not installed.
    RendererError
        If no EGL context can be made.
    """

    def __init__(self) -> None:
        self.name = "egl"
        self._context, self._shader = _program()
        self._target: Any = None

    def render(self, drawables: Sequence[Drawable], camera: Camera, width: int, height: int) -> UInt8:
        import moderngl

        size = (width * SAMPLES, height * SAMPLES)
        target = self._framebuffer(size)
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0)
        self._context.enable_only(moderngl.DEPTH_TEST)
        drawables = [d for d in drawables if len(d.triangles)]
        matrix = camera.clip_matrix(width, height, *depth_range(drawables, camera))
        matrix[:, 3] += matrix[:, :3] @ np.asarray(camera.target)
        self._shader["matrix"].write(np.ascontiguousarray(matrix.T, dtype=np.float32).tobytes())
        for drawable in drawables:
            self._draw(drawable, camera)
        samples = np.frombuffer(target.read(components=4), dtype=np.uint8).reshape(size[1], size[0], 4)
        return resolve(samples[::-1])

    def _framebuffer(self, size: tuple[int, int]) -> Any:
        if self._target is None or self._target.size != size:
            if self._target is not None:
                self._target.release()
            context = self._context
            self._target = context.framebuffer(
                color_attachments=[context.renderbuffer(size, 4)],
                depth_attachment=context.depth_renderbuffer(size),
            )
        return self._target

    def _draw(self, drawable: Drawable, camera: Camera) -> None:
        iris, decal = drawable.iris, drawable.decal
        corners = np.zeros((len(drawable.triangles), 3, 3 + ATTRIBUTES + 3), dtype=np.float32)
        # Places relative to the target: single precision must not meet coordinates far from the origin.
        corners[..., :3] = (drawable.vertices - np.asarray(camera.target))[drawable.triangles]
        corners[..., 3 : 3 + ATTRIBUTES] = corner_attributes(drawable, camera.rotation())
        texture = None
        if iris is not None:
            corners[..., 3 + ATTRIBUTES :] = iris.directions[drawable.triangles]
            self._shader["iris_color"].value = iris.color
        elif decal is not None:
            corners[..., 3 + ATTRIBUTES : 5 + ATTRIBUTES] = decal.uv
            texture = self._texture(decal)
            texture.use(0)
        self._shader["iris_angle"].value = 0.0 if iris is None else iris.angle
        self._shader["has_decal"].value = texture is not None
        self._shader["quarters"].value = round(4 * drawable.opacity)
        data = self._context.buffer(corners.tobytes())
        layout = [(data, "3f 3f 3f 1f 3f", "place", "normal", "albedo", "gloss", "rest")]
        array = self._context.vertex_array(self._shader, layout)
        array.render()
        for used in (array, data, texture):
            if used is not None:
                used.release()

    def _texture(self, decal: Decal) -> Any:
        import moderngl

        height, width = decal.image.shape[:2]
        texture = self._context.texture((width, height), 3, decal.image.tobytes(), alignment=1)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture
