from .cable_interference import Obstacles as Obstacles
from .cable_interference import beams as beams
from .cable_interference import clearances as clearances
from .certified_boxes import certify as certify
from .demanded_wrenches import SpatialSet as SpatialSet
from .pose_grid import grid_by_count as grid_by_count
from .static_feasibility import StaticCase as StaticCase
from .volume import triangles as triangles
