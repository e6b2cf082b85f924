"""What a surface of a physically based renderer has beyond a colour: maps, factors and how images are laid on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

WRAPS = ("repeat", "clamp", "mirror")
MAGNIFY = ("linear", "nearest")
MINIFY = (
    "linear", "nearest", "nearest_mipmap_nearest", "linear_mipmap_nearest", "nearest_mipmap_linear",
    "linear_mipmap_linear",
)  # fmt: skip
ALPHA_MODES = ("opaque", "mask", "blend")


@dataclass(frozen=True, slots=True)
class TextureMap:
    """An image on a surface.

    Attributes
    ----------
    image : its path or URI, as a material's texture.
    texcoord : which set of texture coordinates it lies on; 0 is that of the mesh, 1 and above are vertex attributes
        of the scene.
    wrap : what lies beyond its edges along u and v, of `WRAPS`.
    magnify, minify : how it is sampled, of `MAGNIFY` and `MINIFY`; empty where the file leaves it open.
    offset, rotation, scale : of the texture coordinates, (0, 0) the upper left corner of the image: scaled, turned
        (radians), moved, as glTF's KHR_texture_transform has it.
    """

    image: str
    texcoord: int = 0
    wrap: tuple[str, str] = ("repeat", "repeat")
    magnify: str = ""
    minify: str = ""
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)

    @property
    def transformed(self) -> bool:
        """True where the image does not lie on the plain texture coordinates."""
        return (self.offset, self.rotation, self.scale) != ((0.0, 0.0), 0.0, (1.0, 1.0))


@dataclass(frozen=True, slots=True)
class Shading:
    """A metallic-roughness surface (glTF 2.0). Its colour, glow and base image are those of the `Material`.

    Attributes
    ----------
    base : how the material's texture is laid on; None for a plain one.
    metallic_roughness : roughness in green, metal in blue; occlusion : in red; normal : in tangent space.
    opacity : the factor of the base colour's alpha.
    alpha_mode : what alpha does, of `ALPHA_MODES`; mask draws where it reaches alpha_cutoff. Empty where the file
        leaves it open: then the material's transparency tells, and holes in its image.
    glow : factor of the material's emissive colour and of the map, above 1 for lights.
    """

    base: TextureMap | None = None
    metallic: float = 0.0
    roughness: float = 0.8
    metallic_roughness: TextureMap | None = None
    normal: TextureMap | None = None
    normal_scale: float = 1.0
    occlusion: TextureMap | None = None
    occlusion_strength: float = 1.0
    emissive: TextureMap | None = None
    glow: float = 1.0
    opacity: float = 1.0
    alpha_mode: str = ""
    alpha_cutoff: float = 0.5
    double_sided: bool = True
    unlit: bool = False

    @property
    def maps(self) -> tuple[TextureMap, ...]:
        """All maps that there are, the base first."""
        every = (self.base, self.metallic_roughness, self.normal, self.occlusion, self.emissive)
        return tuple(m for m in every if m is not None)

    def renamed(self, names: Mapping[str, str]) -> Shading:
        """The same with other names of its images; those without a new one keep theirs."""

        def new(value: TextureMap | None) -> TextureMap | None:
            return None if value is None else replace(value, image=names.get(value.image, value.image))

        return replace(
            self,
            base=new(self.base),
            metallic_roughness=new(self.metallic_roughness),
            normal=new(self.normal),
            occlusion=new(self.occlusion),
            emissive=new(self.emissive),
        )
