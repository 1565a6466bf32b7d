"""A small mechanism as files, which tests change."""

from pathlib import Path

BOX = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'


def link(name: str, mass: float = 1.0) -> str:
    """A link of URDF."""
    inertial = f'<inertial><mass value="{mass}"/>{BOX}</inertial>'
    return f'<link name="{name}">{inertial}</link>'


ARM = f"""<robot name="arm">{link("platform")}{link("lower")}
<joint name="elbow" type="revolute">
  <parent link="platform"/><child link="lower"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="1"/>
</joint></robot>
"""

DIRECTIVES = """directives:
- add_model: {name: arm, file: arm.urdf}
- add_frame:
    name: block
    X_PF: {base_frame: world, translation: [1, 0, 0], rotation: !Rpy {deg: [0, 90, 0]}}
"""

MECHANISM = """name: small
mechanism: arm.dmd.yaml
home: {joints: {arm::elbow: 0.2}, bodies: {arm::platform: {position: [0, 0, 0.5]}}}
cable: {youngs_modulus: 1.0e11, diameter: 0.001, linear_density: 0.003, retardation_time: 0}
tension_bounds: {lower: 1, upper: 100}
cables:
  - {name: C1, exit_point: [0, 0, 0.5], exit_frame: block, anchor_point: [0.1, 0.1, 0],
     anchor_frame: platform}
  - {name: E, exit_point: [0, 0.1, 0], exit_frame: platform,
     via: [{frame: arm::lower, point: [0, 0.1, -0.1]}], anchor_point: [0, 0.02, -0.2],
     anchor_frame: arm::lower}
"""


def write_small(folder: Path, text: str = MECHANISM, **files: str) -> Path:
    """Writes the mechanism into a folder; `files` are others by their stems, `arm` for arm.urdf."""
    (folder / "arm.urdf").write_text(files.get("arm", ARM), encoding="utf-8")
    (folder / "arm.dmd.yaml").write_text(files.get("directives", DIRECTIVES), encoding="utf-8")
    path = folder / "small.yaml"
    path.write_text(text, encoding="utf-8")
    return path
