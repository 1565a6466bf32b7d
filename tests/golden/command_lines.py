"""Command lines that are answered briefly, on robots that ship and on small files of their own.

A line is what stands behind `cdpr`. Lines with && between them run one after the other in one
empty folder; the last one's answer is kept, the others make its files.
"""

from __future__ import annotations

from pathlib import Path

BETWEEN = " && "
"""Between command lines of one answer."""

WITHOUT_JSON = ("schema", "new")
"""Commands that have no option --json."""

GRID = "--workers 1 --out out"
LARGE = "workspace acrobot_large"
PLANAR = "workspace planar --grid 5,5,1"
BREAKS = "workspace acrobot_large --kind dynamic-single-failure --grid 2,2,1 --after 0.4"
SAMPLED = "--verdict sampled --draws 5"
SMALL = f"stability acrobot_small {SAMPLED} --grid 3,3,3"
RAILS = "reconfigure planar --rails rails.yaml --limits 1,60 --starts 1 --boxes 500"
NEAR = "--poses 0.15,0.1,0.3;-0.1,-0.15,0.3 --around 0.002 --turn 0.2"
WAY = "--waypoints 0,0,0.3;0.1,0.05,0.3 --stations 40"

TENSION = {
    "tension-home": "tension acrobot_large",
    "tension-all-methods": "tension acrobot_large --pose 0.35,-0.27,0.45 --method all",
    "tension-turned": "tension caroca --pose 0.3,0.5,1.2,5,-4,10 --method all",
    "tension-fully-constrained": "tension acrobot_fully_constrained --method all --limits 1,60",
    "tension-ten-cables": "tension segesta --method all",
    "tension-planar": "tension planar --pose 0.1,0.05,0.3,0,0,10 --method all",
    "tension-point": "tension spider_camera --pose 0.2,-0.1,1 --method all",
    "tension-wall": "tension gt_graffiti --method all",
    "tension-suspended": "tension cogiro --pose 1,-1,2 --method barycenter",
    "tension-underactuated": "tension grab_four --pose 0.6,1.16,-1.5 --method all",
    "tension-three-cables": "tension grab_three --pose 0.6,1.16,-1.5 --wrench 0,0,0,2,0,0",
    "tension-wrench": "tension acrobot_large --wrench 0.1,-0.2,0.3,4,-5,6 --method all",
    "tension-force": "tension acrobot_large --force 4,-5,6 --method closed_form",
    "tension-moment": "tension acrobot_large --force 1,0,0 --moment 0,0,0.4 --method dykstra",
    "tension-limits": "tension acrobot_large --limits 2,18 --method all",
    "tension-infeasible": "tension acrobot_large --pose 0.55,0.5,1.1 --method all",
    "tension-mass": "tension acrobot_large --mass 6.5 --method log_barrier",
    "tension-no-pulleys": "tension caroca --no-pulleys --method all",
    "tension-reference": "tension acrobot_large --method reference_program --reference 14",
    "tension-length-scale": "tension acrobot_large --method slack_relaxed --length-scale 0.2",
    "tension-own-robot": "tension own.yaml --pose 0.3,-0.2,1.2 --method all",
    "tension-mechanism": "tension cable_arm --method all",
    "tension-mechanism-joint": (
        "tension cable_arm --joint elbow=0.5 --limits 5,250 --method linear_program"
    ),
    "tension-mechanism-held": "tension arm_on_platform --held none",
    "tension-mechanism-platforms": "tension two_platforms --method closed_form --no-pulleys",
    "tension-plot": "tension acrobot_large --method all --plot polygon=a.png --plot wrenches=b.png",
    "tension-refused-robot": "tension no_such_robot",
    "tension-refused-method": "tension acrobot_large --method guess",
    "tension-refused-both": "tension acrobot_large --wrench 0,0,0,1,0,0 --force 1,0,0",
    "tension-refused-joint": "tension acrobot_large --joint elbow=0.5",
    "tension-refused-plot": "tension grab_four --plot a.png",
}

STATIC = {
    "static-home": "static acrobot_large",
    "static-pose": "static acrobot_large --pose 0.2,-0.1,0.4,5,-5,10 --cable-model elastic",
    "static-catenary": "static caroca --pose 0,0,1.5 --cable-model catenary",
    "static-inextensible": "static caroca --cable-model inextensible --no-pulleys",
    "static-kelvin-voigt": "static cogiro --cable-model kelvin_voigt",
    "static-sag": "static cable_robot_simulator --cable-model catenary",
    "static-lengths": (
        "static acrobot_large --lengths 1.2,1.2,1.2,1.2,1.2,1.2,1.2,1.2 --no-pulleys"
    ),
    "static-lengths-pulleys": "static acrobot_small --lengths 0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9",
    "static-underactuated": "static grab_three --lengths 1.8,1.9,1.8",
    "static-planar": "static planar --pose 0.05,0.05,0.3",
    "static-point": "static maslow_4",
    "static-behaviour": "static own.yaml --pose 0.2,0.1,1.2 --plot behaviour=a.png",
    "static-behaviour-no-pulleys": "static own.yaml --no-pulleys",
    "static-rails": f"{RAILS} {NEAR} --out moved && static moved/robot.yaml@C1=0.1,C3=-0.05",
    "static-mechanism": "static cable_arm",
    "static-mechanism-pose": "static cable_arm --yields pose --prestress 40",
    "static-mechanism-free": "static cable_arm --free elbow --limits 5,200",
    "static-mechanism-joint": "static arm_on_platform --joint shoulder=0.1 --prestress 10",
    "static-mechanism-held": "static arm_on_platform --held none",
    "static-mechanism-model": "static mobile_bases --cable-model kelvin_voigt",
    "static-refused-both": "static acrobot_large --pose 0,0,0.3 --lengths 1,1,1,1,1,1,1,1",
    "static-refused-lengths": "static acrobot_large --lengths 1,1,1",
    "static-refused-pose": "static cable_arm --pose 0,0,0.3",
    "static-refused-sag": "static fast --cable-model catenary",
    "static-refused-unbalanced": "static grab_three --pose 0.6,1.16,-1.5",
    "static-refused-file": "static broken.yaml",
}

EQUILIBRIA = {
    "equilibria-lengths": "equilibria grab_three --lengths 1.8,1.9,1.8",
    "equilibria-position": "equilibria grab_three --position 0.6,1.16,-1.5",
    "equilibria-taut": "equilibria grab_four --position 0.6,1.16,-1.5 --taut C1,C2,C3",
    "equilibria-elastic": (
        "equilibria grab_three --lengths 1.8,1.9,1.8 --cable-model elastic --searches 20 --seed 3"
    ),
    "equilibria-elastic-no-pulleys": (
        "equilibria caroca --lengths 3.5,3.5,3.5,3.5,3.5,3.5,3.5,3.5 --cable-model elastic "
        "--searches 5 --no-pulleys"
    ),
    "equilibria-point": "equilibria spider_camera --lengths 2.982,3.294,3.217,2.896",
    "equilibria-refused-neither": "equilibria grab_three",
    "equilibria-refused-position": "equilibria grab_three --position 0,0",
}

WORKSPACE = {
    "workspace-static": f"{LARGE} --grid 5,5,3 {GRID}",
    "workspace-kinds": (
        f"{LARGE} --kind statically-stable,wrench-closure,singularity-free --grid 5,5,3 {GRID}"
    ),
    "workspace-clear": (
        f"{LARGE} --kind interference-free,collision-free --clearance 0.01 --anchor-free 0.05 "
        f"--exit-free 0.1 --obstacles obstacles.yaml --grid 5,5,3 {GRID}"
    ),
    "workspace-dynamic": (
        "workspace acrobot_fully_constrained --kind dynamic --acceleration 0.5,1 --velocity 0,0,1 "
        f"--velocity 0,1,0 --grid 5,5,3 --limits 0.5,60 {GRID}"
    ),
    "workspace-wrench-feasible": (
        f"{LARGE} --kind wrench-feasible --force 2 --moment 0.1 --grid 5,5,3 {GRID}"
    ),
    "workspace-wrench-vertices": (
        f"{LARGE} --kind wrench-feasible --wrench-set vertices.yaml --grid 5,5,3 {GRID}"
    ),
    "workspace-wrench-ellipsoid": (
        f"{LARGE} --kind wrench-feasible --wrench-set ellipsoid.yaml --grid 5,5,3 {GRID}"
    ),
    "workspace-single-failure": (
        "workspace segesta --kind single-failure --measure breaks-survived,failure-margin "
        f"--grid 5,5,2 {GRID}"
    ),
    "workspace-breaks": f"{BREAKS} --scenario acrobot_broken_redistributed {GRID}",
    "workspace-breaks-reactions": (
        f"{BREAKS} --measure break-excursion,worst-cable,best-reaction --reactions stop,brake "
        f"--moving 0.1,0,0 {GRID}"
    ),
    "workspace-visible": (
        f"workspace acrobot_small --kind target-visible --scenario acrobot_pbvs --grid 7,7,3 {GRID}"
    ),
    "workspace-stable": (
        f"workspace acrobot_small --kind stable --scenario acrobot_pbvs --grid 2,2,1 {GRID}"
    ),
    "workspace-measures": (
        f"{LARGE} --measure capacity-margin,tension-factor,payload,stiffness,frequency,dexterity,"
        f"clearance --grid 5,5,2 {GRID}"
    ),
    "workspace-orientations": (
        f"{LARGE} --orientation 0,0,-20:20:20 --orientation 5,0,0 --orientations any "
        f"--grid 5,5,3 {GRID}"
    ),
    "workspace-planar": (
        f"{PLANAR} --kind wrench-feasible --force 1 --orientation 0,0,-20:20:20 "
        f"--certify --boxes 300 {GRID}"
    ),
    "workspace-hull": f"{LARGE} --grid 5,5,2 --hull 0,0,0.3 --rays 300 --tolerance 0.01 {GRID}",
    "workspace-unbounded": (
        f"{LARGE} --grid 2,2,2 --hull 0,0,0.3 --rays 100 --unbounded --mesh out.obj {GRID}"
    ),
    "workspace-box": (
        f"{LARGE} --box=-0.2:0.2,-0.2:0.2,0.1:0.5 --grid 3,3,3 --hull 0,0,0.3 --rays 100 {GRID}"
    ),
    "workspace-certified": f"{LARGE} --grid 5,5,3 --certify --boxes 1000 {GRID}",
    "workspace-certified-errors": (
        f"{LARGE} --grid 3,3,3 --certify --boxes 500 --exit-error 0.002 --anchor-error 0.001 {GRID}"
    ),
    "workspace-certified-obstacles": (
        f"{PLANAR} --kind static,collision-free --certify --boxes 500 --obstacles flat.yaml {GRID}"
    ),
    "workspace-refined": (
        f"{PLANAR} --certify --boxes 300 --refine -0.5,-0.5,0.3;0.5,0.5,0.3 --refine-reach 0.01 "
        f"--refine-boxes 200 {GRID}"
    ),
    "workspace-method": f"{LARGE} --method closed_form --grid 5,5,3 {GRID}",
    "workspace-load": (
        f"{LARGE} --limits 2,40 --mass 4.5 --wrench 0,0,0,3,0,0 --grid 5,5,3 "
        f"--figure-format svg {GRID}"
    ),
    "workspace-no-pulleys": f"workspace caroca --no-pulleys --grid 5,5,3 {GRID}",
    "workspace-refused-kind": f"{LARGE} --kind nice {GRID}",
    "workspace-refused-grid": f"workspace planar --grid 5,5,5 {GRID}",
    "workspace-refused-box": f"{LARGE} --box 0:1 {GRID}",
    "workspace-refused-force": f"{LARGE} --kind wrench-feasible {GRID}",
}

STABILITY = {
    "stability-pbvs": f"{SMALL} {GRID}",
    "stability-line": f"{SMALL} --scheme pbvs-line {GRID}",
    "stability-hybrid": f"{SMALL} --scheme 2.5d {GRID}",
    "stability-ibvs": f"{SMALL} --scheme ibvs --vary r_A=0.005,0.05 {GRID}",
    "stability-printed-matrix": f"{SMALL} --printed-matrix --seed 4 {GRID}",
    "stability-scenario": f"{SMALL} --scenario acrobot_pbvs {GRID}",
    "stability-turned": f"{SMALL} --orientation 0,0,0 --orientation 0,0,20 {GRID}",
    "stability-bounds": f"{SMALL} --bounds bounds.yaml --vary d_theta_pc_deg=1,5 {GRID}",
    "stability-load": (
        f"stability acrobot_large {SAMPLED} --grid 3,3,2 --limits 2,40 --mass 4.5 "
        f"--wrench 0,0,0,3,0,0 --no-pulleys {GRID}"
    ),
    "stability-planar": f"stability planar {SAMPLED} --grid 3,3,1 {GRID}",
    "stability-searched": (
        f"stability acrobot_small --verdict searched --draws 5 --searches 2 --grid 2,2,1 {GRID}"
    ),
    "stability-certified": (
        f"stability acrobot_small --verdict certified --draws 5 --searches 1 --pieces 20 "
        f"--grid 2,2,1 {GRID}"
    ),
    "stability-along": (
        "simulate acrobot_pbvs --camera projected --duration 1 --out run && "
        "stability --along run --threshold 2 --out out"
    ),
    "stability-refused-scheme": f"{SMALL} --scheme no_such {GRID}",
    "stability-refused-along": "stability --along nowhere --out out",
    "stability-refused-bounds": f"{SMALL} --bounds rails.yaml {GRID}",
}

PLAN = {
    "plan-planar": f"plan planar {WAY} --out out",
    "plan-limits": (
        f"plan planar {WAY} --no-track --cable-speed 0.3 --cable-acceleration 2 --speed 0.2 "
        "--reserve 0.1 --out out"
    ),
    "plan-table": "plan planar --path path.csv --no-track --stations 40 --out out",
    "plan-blended": (
        "plan planar --path path.csv --no-track --stations 40 --corners blend --tolerance 0.02 "
        "--no-pulleys --out out"
    ),
    "plan-to-rest": (
        "plan planar --path path.csv --no-track --stations 40 --corners rest --out out"
    ),
    "plan-no-feeds": "plan maslow_4 --path sheet.gcode --no-feeds --no-track --out out",
    "plan-resist": f"plan planar {WAY} --no-track --resist push.yaml --out out",
    "plan-stream": (
        "plan acrobot_large --waypoints 0,0,0.2;0.1,-0.1,0.3 --limits 1,60 --no-track "
        "--stations 40 --stream 50 --stream-model catenary --out out"
    ),
    "plan-free-tension": (
        "plan planar --free --from 0,0,0.3 --to 0.1,0.05,0.3 --knots 5 --least tension "
        "--duration 1.5 --no-track --out out"
    ),
    "plan-free-energy": (
        "plan planar --free --from 0,0,0.3 --to 0.1,0.05,0.3 --knots 5 --least energy --no-track "
        "--out out"
    ),
    "plan-free-clear": (
        "plan acrobot_large --free --from 0,0,0.2 --to 0.1,-0.1,0.3 --knots 5 --limits 1,60 "
        "--clearance 0.005 --obstacles obstacles.yaml --no-track --out out"
    ),
    "plan-proven": (
        "plan acrobot_large --proven --from 0,0,0.3 --to 0.05,0.05,0.3 --boxes 500 "
        "--acceleration 0 --no-track --out out"
    ),
    "plan-proven-time": (
        "plan acrobot_large --proven --time --from 0,0,0.3 --to 0.05,0,0.3 --boxes 500 "
        "--acceleration 0.2 --method gcs --no-track --out out"
    ),
    "plan-refused-nothing": "plan planar --out out",
    "plan-refused-free": "plan planar --free --from 0,0,0.3 --out out",
    "plan-refused-proven": "plan planar --proven --knots 5 --from 0,0,0.3 --to 0.1,0,0.3",
}

DESIGN = {
    "reconfigure-poses": f"{RAILS} {NEAR} --out out",
    "reconfigure-tension": f"{RAILS} {NEAR} --goal tension --out out",
    "reconfigure-path": (
        f"{RAILS} --path path.csv --samples 3 --resist push.yaml --around 0.002 --turn 0.2 "
        "--out out"
    ),
    "reconfigure-refused-rails": "reconfigure planar --poses 0,0,0.3 --out out",
    "reconfigure-refused-far": f"{RAILS} --poses 0.9,0.9,0.3 --out out",
    "design-quick": (
        "design acrobot_large --goal static --goal accuracy=0.5 --quick --generations 1 --seed 2 "
        "--boxes 100 --out out"
    ),
    "design-planar": "design planar --goal capacity-margin --force 1 --quick --out out",
    "design-refused-goal": "design acrobot_large --goal beauty --out out",
}

FILES_OF_USERS = {
    "robots": "robots",
    "robots-filtered": "robots --motion 3R3T --cables 6-8 --suspended --no-camera",
    "robots-search": "robots --search acrobot --camera",
    "robots-underactuated": "robots --underactuated",
    "robots-mechanisms": "robots --mechanisms",
    "robots-gallery": "robots --search planar --gallery planar.html",
    "robots-refused-none": "robots --cables 11-",
    "robots-refused-motion": "robots --motion 4T",
    "scenarios": "scenarios",
    "environments": "environments",
    "environments-one": "environments Track --robot caroca --action tensions",
    "environments-refused": "environments Fly",
    "examples": "examples",
    "examples-copied": "examples own_robot --out out",
    "notebooks": "notebooks",
    "schema-robot": "schema robot",
    "schema-mechanism": "schema mechanism",
    "schema-scenario": "schema scenario",
    "schema-refused": "schema camera",
    "new-robot": "new robot mine --out out",
    "new-robot-copied": "new robot mine --from planar --out out",
    "new-scenario": "new scenario mine --out out",
    "new-scenario-copied": "new scenario mine --from cable_arm_computed_torque --out out",
    "new-scenario-for-robot": "new scenario mine --robot caroca --out out",
    "new-scenario-without-camera": "new scenario mine --robot cogiro --out out",
    "new-controller": "new controller law --out out",
    "new-estimator": "new estimator look --out out",
    "new-study": "new study mine --out out",
    "new-refused-kind": "new gripper mine --out out",
    "new-refused-robot": "new scenario mine --robot grab_four --out out",
    "check-names": "check acrobot_large acrobot_pbvs caroca_catenary",
    "check-own": "check own.yaml small.yaml lengths.csv grab.json",
    "check-new": "new scenario mine --robot own.yaml --out . && check mine.yaml own.yaml",
    "check-bad": "check bad_robot.yaml broken.yaml bad_scenario.yaml own.yaml nothing.yaml",
    "check-plot": "check lengths.csv --plot a.png",
    "import-grab": "import grab.json --out out",
    "import-sdf": "export caroca --format sdf --out theirs && import theirs/caroca.sdf --out out",
    "import-sdf-drake": (
        "export acrobot_small --format sdf-drake --out theirs && "
        "import theirs/acrobot_small.sdf --out out"
    ),
    "import-urdf": (
        "export acrobot_large --format urdf --out theirs && "
        "import theirs/acrobot_large.urdf --name mine --out out"
    ),
    "import-mjcf": "export caroca --format mjcf --out theirs && import theirs/caroca.xml --out out",
    "import-wcrfx": (
        "export ipanema_1 --format wcrfx --out theirs && import theirs/ipanema_1.wcrfx --out out"
    ),
    "import-caspr": (
        "export ipanema_1 --format caspr --out theirs && "
        "import theirs/ipanema_1_bodies.xml --out out"
    ),
    "import-gazebo": (
        "export caroca_gazebo --format gazebo-yaml --out theirs && "
        "import theirs/caroca_gazebo.yaml --out out"
    ),
    "import-mechanism": (
        "export bm_arm --format caspr --out theirs && import theirs --name arm --out out"
    ),
    "import-refused": "import own.yaml --out out",
    "export-mechanism": "export bm_arm --format caspr --out out",
    "export-drake": "export acrobot_large --format drake --out out",
    "export-klipper": "export hangprinter_4 --format klipper --out out",
    "export-reprapfirmware": "export hangprinter_4 --format reprapfirmware --out out",
    "export-maslow": "export maslow_4 --format maslow --out out",
    "export-own": "export own.yaml --format mjcf --out out",
    "export-refused": "export acrobot_large --format step --out out",
}

RUNS = {
    "simulate-settings": (
        "simulate acrobot_pbvs --camera projected --duration 0.5 --seed 3 "
        "--set controller.lambda_0=1.5 --log-rate 50 --out out"
    ),
    "simulate-seeds": (
        "simulate acrobot_pbvs --camera projected --duration 0.5 --seeds 0:2 --workers 1 --out out"
    ),
    "simulate-reactions": (
        "reactions acrobot_broken_redistributed --cable 5 --time 0.2 --after 0.3 "
        "--reactions none,stop --out out"
    ),
    "simulate-refused-key": "simulate acrobot_pbvs --set controller.no_such=1 --out out",
}

COMMAND_LINES = {
    f"commands/{name}": line
    for table in (
        TENSION, STATIC, EQUILIBRIA, WORKSPACE, STABILITY, PLAN, DESIGN, FILES_OF_USERS, RUNS,
    )
    for name, line in table.items()
}  # fmt: skip
"""Lines behind `cdpr` by the name of the golden file."""

OWN_ROBOT = """\
name: own
motion: 3R3T
platform: {mass: 9.0, size: [0.35, 0.3, 0.15]}
cable:
  youngs_modulus: 90.0e9
  diameter: 0.0025
  linear_density: 0.005
  retardation_time: 0.0001
  behaviour: {stiffening: 2.0e-3, expansion: 1.2e-5, warmer: 12.0, sheave_friction: 0.03}
pulley: {radius: 0.025}
winch: {drum_radius: 0.05, gear_ratio: 8.0, motor_speed_rpm: 3000.0}
tension_bounds: {lower: 4.0, upper: 350.0}
frame: {lower: [-2.5, -1.75, 0.0], upper: [2.5, 1.75, 2.8], beam: 0.05}
home: {position: [0.0, 0.0, 1.1]}
cables:
  - {name: A1, exit_point: [-2.4, -1.65, 2.7], anchor_point: [0.175, -0.15, 0.15]}
  - {name: A2, exit_point: [-2.45, -1.55, 2.7], anchor_point: [-0.175, 0.15, 0.0]}
  - {name: B1, exit_point: [-2.45, 1.55, 2.7], anchor_point: [-0.175, -0.15, 0.15]}
  - {name: B2, exit_point: [-2.4, 1.65, 2.7], anchor_point: [0.175, 0.15, 0.0]}
  - {name: C1, exit_point: [2.4, 1.65, 2.7], anchor_point: [-0.175, 0.15, 0.15]}
  - {name: C2, exit_point: [2.45, 1.55, 2.7], anchor_point: [0.175, -0.15, 0.0]}
  - {name: D1, exit_point: [2.45, -1.55, 2.7], anchor_point: [0.175, 0.15, 0.15]}
  - {name: D2, exit_point: [2.4, -1.65, 2.7], anchor_point: [-0.175, -0.15, 0.0]}
"""

BOX = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
ARM = f"""\
<robot name="arm">
<link name="platform"><inertial><mass value="1"/>{BOX}</inertial></link>
<link name="lower"><inertial><mass value="1"/>{BOX}</inertial></link>
<joint name="elbow" type="revolute">
  <parent link="platform"/><child link="lower"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="1"/>
</joint></robot>
"""
MECHANISM = """\
name: small
mechanism: arm.dmd.yaml
home: {joints: {arm::elbow: 0.2}, bodies: {arm::platform: {position: [0, 0, 0.5]}}}
cable: {youngs_modulus: 1.0e11, diameter: 0.001, linear_density: 0.003, retardation_time: 0}
tension_bounds: {lower: 1, upper: 100}
cables:
  - {name: C1, exit_point: [0, 0, 1.5], anchor_point: [0.1, 0.1, 0], anchor_frame: platform}
  - {name: E, exit_point: [0, 0.1, 0], exit_frame: platform,
     via: [{frame: arm::lower, point: [0, 0.1, -0.1]}], anchor_point: [0, 0.02, -0.2],
     anchor_frame: arm::lower}
"""

GRAB_CABLE = (
    '{{"active": true, "pulley": {{"radius": 0.02, "pos_OD_glob": [[{}], [{}], [2.0]], '
    '"vers_k": [[0], [0.6], [0.8]]}}, "winch": {{"pos_PA_loc": [[{}], [{}], [0.05]]}}}}'
)
GRAB_CABLES = ", ".join(
    GRAB_CABLE.format(*place)
    for place in ((-2.0, 1.5, -0.06, 0.06), (2.0, 1.5, 0.06, 0.06), (2.0, -1.5, 0.06, -0.06))
)

INPUT_FILES = {
    "own.yaml": OWN_ROBOT,
    "arm.urdf": ARM,
    "arm.dmd.yaml": "directives:\n- add_model: {name: arm, file: arm.urdf}\n",
    "small.yaml": MECHANISM,
    "grab.json": (
        f'{{"actuator": [{GRAB_CABLES}], "platform": {{"mass": 2.5, '
        '"gravity_axis": [[0], [0], [1]], "pos_PG_loc": [[0.01], [-0.02], [0.03]], '
        '"inertia_mat_G_loc": [[0.1, 0.01, 0], [0.01, 0.2, -0.02], [0, -0.02, 0.25]]}}\n'
    ),
    "bad_robot.yaml": (
        OWN_ROBOT.replace("mass: 9.0", "mass: -9.0").replace("name: A2", "name: A1")
        + "winches: 8\n"
    ),
    "broken.yaml": "name: [broken\n",
    "bad_scenario.yaml": "name: bad\nrobot: acrobot_small\nkind: flight\n",
    "lengths.csv": "time_s,C1_length_m,C2_length_m\n0,1.0,1.1\n0.1,1.01,1.09\n0.2,1.03,1.07\n",
    "vertices.yaml": "vertices: [[0, 0, 0, 5, 0, 0], [0, 0, 0, -5, 0, 0]]\n",
    "ellipsoid.yaml": "ellipsoid: [0.05, 0.05, 0.05, 2, 2, 2]\n",
    "push.yaml": "box: [0, 0, 0.05, 2, 2, 0]\n",
    "obstacles.yaml": (
        "boxes:\n  - {pose: {position: [0.4, 0.4, 0.175]}, size: [0.06, 0.06, 0.35]}\n"
        "spheres: [{position: [-0.4, 0.4, 0.15], radius: 0.08}]\n"
        "capsules: [{start: [-0.5, -0.4, 0.1], end: [-0.4, -0.5, 0.4], radius: 0.04}]\n"
    ),
    "flat.yaml": (
        "spheres: [{position: [0.1, 0.1, 0.3], radius: 0.05}]\n"
        "capsules: [{start: [-0.2, 0.0, 0.3], end: [-0.2, 0.2, 0.3], radius: 0.02}]\n"
    ),
    "bounds.yaml": "r_A: 0.01\nd_theta_bp_deg: 5\nexits: common\n",
    "rails.yaml": (
        "rails:\n  - {cables: [C1, C2], axis: [0, 1, 0], lower: -0.3, upper: 0.3}\n"
        "  - {cables: [C3], axis: [0, 2, 0], lower: -0.3, upper: 0.3}\n"
    ),
    "path.csv": "0.15,0.1,0.3\n0,0.05,0.3\n-0.1,-0.15,0.3\n",
    "sheet.gcode": "G90 G21\nG0 X1200 Y600 Z0 F2000\nG1 X1250 F1500\nG1 Y630\n",
}
"""Texts of the files that lines name, and of those that these name."""


def commands_of(name: str) -> list[list[str]]:
    """The commands of a golden file in turn, as words behind `cdpr`; the last one is kept."""
    *before, last = COMMAND_LINES[name].split(BETWEEN)
    if not last.startswith(WITHOUT_JSON):
        last += " --json"
    return [line.split() for line in (*before, last)]


def write_input_files(folder: Path) -> None:
    """Writes all files that lines name; none of them takes time."""
    for name, text in INPUT_FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
