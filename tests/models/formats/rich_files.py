"""Files of other tools with much in them that a robot on cables has no place for."""

CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))

URDF = (
    """<robot name="rich">
 <material name="steel"><color rgba="1 0 0 1"/></material>
 <link name="world"/>
 <link name="platform">
  <inertial><origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/><mass value="2"/>
   <inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0.001" ixz="0.0015" iyz="0.0005"/></inertial>
  <visual><geometry><box size="0.2 0.21 0.1"/></geometry><material name="steel"/></visual>
  <collision><geometry><sphere radius="0.2"/></geometry></collision>
 </link>
 <link name="gripper"><inertial><origin xyz="0.1 0.2 0.3" rpy="0.3 0.2 0.1"/><mass value="0.3"/>
  <inertia ixx="0.001" iyy="0.002" izz="0.0025" ixy="0.0001" ixz="0.0002" iyz="0.0003"/></inertial>
 </link>
 <link name="cube"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0"
  ixz="0" iyz="0"/></inertial></link>
 <link name="gantry"><inertial><mass value="50"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
  iyz="0"/></inertial><collision><geometry><box size="3 3 0.1"/></geometry></collision></link>
 <joint name="hangs" type="floating"><parent link="world"/><child link="platform"/>
  <origin xyz="0.1 0.2 1.1" rpy="0.1 0.2 0.3"/></joint>
 <joint name="stands" type="fixed"><parent link="world"/><child link="gantry"/>
  <origin xyz="0.1 0.1 2" rpy="0.01 0.02 0.03"/></joint>
 <joint name="yaw" type="revolute"><parent link="platform"/><child link="gripper"/>
  <origin xyz="0.05 0.06 -0.1" rpy="0.4 0.5 0.6"/><axis xyz="0 0 1"/>
  <limit effort="1" velocity="2" lower="-1" upper="1"/><dynamics damping="0.1" friction="0.2"/>
 </joint>
 <transmission name="drive"><type>transmission_interface/SimpleTransmission</type>
  <joint name="yaw"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>
  <actuator name="motor"><mechanicalReduction>3</mechanicalReduction></actuator></transmission>
 <gazebo reference="platform"><mu1>0.2</mu1></gazebo>
"""
    + "".join(
        f"""<link name="exit_C{k}"/><joint name="e{k}" type="fixed"><parent link="gantry"/>
 <child link="exit_C{k}"/><origin xyz="{x} {y} 0.{k}1"/></joint>
 <link name="anchor_C{k}"/><joint name="a{k}" type="fixed"><parent link="platform"/>
 <child link="anchor_C{k}"/><origin xyz="{0.1 * x} {0.1 * y} 0.0{k}1"/></joint>
"""
        for k, (x, y) in enumerate(CORNERS, start=1)
    )
    + "</robot>"
)

SDF = (
    """<sdf version="1.9"><world name="hall"><gravity>0 0 -1.62</gravity>
 <physics type="ode"><max_step_size>0.001</max_step_size></physics>
 <light name="sun" type="directional"/>
 <model name="rich">
 <link name="gripper"><pose relative_to="platform">0.05 0.06 -0.1 0.4 0.5 0.6</pose>
  <inertial><pose>0.1 0.2 0.3 0.3 0.2 0.1</pose><mass>0.3</mass><inertia><ixx>0.001</ixx>
   <iyy>0.002</iyy><izz>0.0025</izz><ixy>0.0001</ixy><ixz>0.0002</ixz><iyz>0.0003</iyz></inertia>
  </inertial></link>
 <link name="gantry"><inertial><mass>50</mass></inertial></link>
 <joint name="stands" type="fixed"><parent>world</parent><child>gantry</child></joint>
 <link name="platform"><pose>0.1 0.2 1.1 0.1 0.2 0.3</pose>
  <gravity>false</gravity><sensor name="imu" type="imu"><update_rate>30</update_rate></sensor>
  <inertial><pose>0.01 0.02 0.03 0.1 0.2 0.3</pose><mass>2</mass><inertia><ixx>0.01</ixx>
   <iyy>0.02</iyy><izz>0.025</izz><ixy>0.001</ixy><ixz>0.0015</ixz><iyz>0.0005</iyz></inertia>
  </inertial>
  <visual name="v"><geometry><box><size>0.2 0.21 0.1</size></box></geometry></visual>
  <collision name="c"><geometry><sphere><radius>0.2</radius></sphere></geometry></collision>
 </link>
 <joint name="yaw" type="revolute"><parent>platform</parent><child>gripper</child>
  <axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>1</upper></limit>
  <dynamics><damping>0.1</damping></dynamics></axis></joint>
 <link name="cube"><inertial><mass>1</mass></inertial></link>
 <plugin name="drive" filename="drive.so"><gain>3</gain></plugin>
"""
    + "".join(
        f"""<frame name="exit_C{k}" attached_to="gantry"><pose>{x} {y} 2.{k} 0 0 0</pose></frame>
 <frame name="anchor_C{k}" attached_to="platform"><pose>{0.1 * x} {0.1 * y} 0.0{k} 0 0 0</pose>
 </frame>
"""
        for k, (x, y) in enumerate(CORNERS, start=1)
    )
    + "</model></world></sdf>"
)

MJCF = (
    """<mujoco model="rich">
 <compiler angle="radian"/>
 <option gravity="0.1 0 -9.7" timestep="0.001" wind="1 0 0" density="1.2"/>
 <statistic extent="3"/>
 <default><geom density="900" friction="0.7 0.1 0.1"/><tendon width="0.002"/>
  <default class="arm"><joint damping="0.3"/></default></default>
 <asset><material name="red" rgba="1 0 0 1"/></asset>
 <worldbody>
  <light pos="0 0 3"/>
  <geom name="floor" type="plane" size="3 3 0.1" friction="0.5"/>
  <camera name="top" pos="0 0 3"/>
"""
    + "".join(f'  <site name="w{k}" pos="{x} {y} 2.{k}"/>\n' for k, (x, y) in enumerate(CORNERS))
    + """  <body name="p" pos="0.1 0.2 1.1" euler="0.1 0.2 0.3" gravcomp="0.2">
   <freejoint/>
   <geom type="box" size="0.1 0.11 0.05" mass="2" friction="0.6" rgba="1 0 0 1"/>
   <geom name="ball" type="capsule" size="0.03 0.04" pos="0.1 0 0.1" condim="4"/>
   <site name="imu" pos="0.01 0.02 0"/>
"""
    + "".join(
        f'   <site name="a{k}" pos="{0.1 * x} {0.1 * y} 0.0{k + 1}"/>\n'
        for k, (x, y) in enumerate(CORNERS)
    )
    + """   <body name="g" pos="0.05 0.06 -0.1" euler="0.3 0.2 0.1">
    <joint name="yaw" class="arm" axis="0 0 1" range="-0.2 0.2" stiffness="2"/>
    <geom type="box" size="0.02 0.03 0.04" pos="0.01 0.02 0.03" euler="0.1 0.1 0.2"/>
   </body>
  </body>
  <body name="cube" pos="0.5 0 0.05"><freejoint/><geom type="box" size="0.05 0.05 0.05"/></body>
 </worldbody>
 <tendon>
"""
    + "".join(
        f'  <spatial name="t{k}" range="0 {k + 2}" stiffness="1000" springlength="1.5"'
        f' damping="0.4"><site site="w{k}"/><site site="a{k}"/></spatial>\n'
        for k in range(4)
    )
    + """ </tendon>
 <actuator>
"""
    + "".join(
        f'  <motor tendon="t{k}" gear="-2" forcerange="1 {50 + k}" ctrlrange="0 {40 + k}"/>\n'
        for k in range(4)
    )
    + """  <position joint="yaw" kp="3"/>
 </actuator>
 <sensor><accelerometer site="imu"/></sensor>
 <equality><weld body1="cube" solref="0.01 1"/></equality>
 <contact><exclude body1="p" body2="cube"/></contact>
 <keyframe><key name="start" time="2"
  qpos="0.2 0.1 0.8 1 0 0 0 0.3 0.5 0 0.05 1 0 0 0"/><key name="away"
  qpos="0.3 0.1 0.8 1 0 0 0 0.3 0.5 0 0.05 1 0 0 0"/></keyframe>
</mujoco>
"""
)


POINTS = "".join(
    f'<link name="exit_C{k}"/><joint name="e{k}" type="fixed"><parent link="world"/>'
    f'<child link="exit_C{k}"/><origin xyz="{x} {y} 2"/></joint><link name="anchor_C{k}"/>'
    f'<joint name="a{k}" type="fixed"><parent link="platform"/><child link="anchor_C{k}"/>'
    f'<origin xyz="{0.1 * x} {0.1 * y} 0.05"/></joint>'
    for k, (x, y) in enumerate(CORNERS)
)

SLIDER = '<link name="slider"/>'
HEAVY = """<link name="slider"><inertial><mass value="3"/><inertia ixx="0.01" iyy="0.03" izz="0.02"
 ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def joined(kind, axis="0 1 0", parent="world", child="platform", name="moves"):
    """A joint of URDF, 1 m up unless it is the second of two."""
    limits = '<limit effort="1" velocity="1" lower="-1" upper="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 {0 if name == "second" else 1}"/><axis xyz="{axis}"/>'
        f"{limits if kind in ('revolute', 'prismatic') else ''}</joint>"
    )


def slid(link, second, axis="0 0 1"):
    """A platform on a joint of a link that slides along x."""
    first = joined("prismatic", "1 0 0", child="slider")
    return link + first + joined(second, axis, parent="slider", name="second")


def urdf(joints):
    """What writes a platform on four cables, on these joints."""

    def write(folder):
        path = folder / "r.urdf"
        path.write_text(
            """<robot name="r"><link name="world"/><link name="platform"><inertial>
            <mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.02" ixy="0" ixz="0" iyz="0"/>
            </inertial></link>"""
            f"{joints}{POINTS}</robot>"
        )
        return path

    return write


SITES = "".join(
    f'<site name="a{k}" pos="{0.1 * x} {0.1 * y} 0.05"/>' for k, (x, y) in enumerate(CORNERS)
)


def hung(inner="", after="", world="", sites=SITES):
    """What writes MJCF of a plate on four ropes, with more in it, behind it or in the world."""
    exits = "".join(f'<site name="w{k}" pos="{x} {y} 2"/>' for k, (x, y) in enumerate(CORNERS))
    ropes = "".join(
        f'<spatial name="t{k}"><site site="w{k}"/><site site="a{k}"/></spatial>' for k in range(4)
    )

    def write(folder):
        path = folder / "hung.xml"
        path.write_text(
            f'<mujoco><worldbody>{exits}<body name="p" pos="0 0 1"><freejoint/>'
            f'<geom type="box" size="0.1 0.1 0.05" mass="2"/>{sites}{inner}</body>{world}'
            f"</worldbody><tendon>{ropes}</tendon>{after}</mujoco>"
        )
        return path

    return write
