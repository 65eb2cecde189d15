"""A scene: everything that decides a rendered photo set.

Plain values only, so that a scene can be compared, hashed, changed with ``dataclasses.replace`` and written down whole.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from photogonio.synthetic.scene.parts import (
    BallScene,
    BoardScene,
    CameraScene,
    FaultScene,
    LampScene,
    PatchScene,
    RenderScene,
    SampleScene,
    SensorScene,
)


@dataclass(frozen=True, slots=True)
class Scene:
    """A photo set before it is rendered. ``brdf``: `model` and its parameters, or `file` (synthetic.brdf.library)."""

    name: str
    brdf: dict[str, object]
    seed: int = 1
    length_unit: str = "mm"
    sample: SampleScene = field(default_factory=SampleScene)
    board: BoardScene | None = field(default_factory=BoardScene)
    mirror_ball: tuple[BallScene, ...] = ()
    white_patch: tuple[PatchScene, ...] = ()
    grey_patch: tuple[PatchScene, ...] = ()  # print: the manifest has their outlines, not their reflectances
    camera: CameraScene = field(default_factory=CameraScene)
    lamp: LampScene = field(default_factory=LampScene)
    sensor: SensorScene = field(default_factory=SensorScene)
    render: RenderScene = field(default_factory=RenderScene)
    fault: FaultScene = field(default_factory=FaultScene)
    folder: str = ""  # that paths in ``brdf`` are relative to
