"""What all case studies share: their definition, their runs in parallel, tables and figures.

A `CaseStudy` names configurations of scenarios and the judges of what a thesis states of them;
`run_case_study` runs them with several seeds and writes what they leave. A `SeededStudy` is the
frame of studies with runs of their own: configurations over seeds, continued, judged, written. The
studies themselves are in the rooms of `analyses.studies`.
"""

from cdpr_drake.analyses.case_studies.definition import (
    PULLEYS,
    CaseStudy,
    Configuration,
    PublishedNumber,
)
from cdpr_drake.analyses.case_studies.drawn_study import DrawnStudy
from cdpr_drake.analyses.case_studies.layouts import (
    CableLayout,
    Layout,
    Panel,
    PanelLayout,
    each,
    paths_layout,
)
from cdpr_drake.analyses.case_studies.panels import (
    Draw,
    bars,
    corners_at,
    draw_corner_paths,
    draw_errors,
    draw_estimate_angle,
    draw_estimate_distance,
    draw_estimated_paths,
    draw_final_places,
    draw_image_deviation,
    draw_image_paths,
    draw_platform_from_above,
    draw_platform_paths,
    draw_positions,
    draw_stable,
    draw_taut,
    draw_velocities,
    last,
    metric,
    trace,
)
from cdpr_drake.analyses.case_studies.pose_offsets import (
    as_transform,
    between,
    camera_belief,
    pose_item,
    turned,
)
from cdpr_drake.analyses.case_studies.run import (
    METRICS,
    CaseJob,
    CaseRun,
    CaseRuns,
    Metric,
    OwnMetric,
)
from cdpr_drake.analyses.case_studies.seeded_study import (
    Found,
    SeededStudy,
    constants_of,
    over_seeds,
)
from cdpr_drake.analyses.case_studies.statements import same_accuracy
from cdpr_drake.analyses.case_studies.study import run_case_study
from cdpr_drake.analyses.case_studies.tracking_experiments import (
    SETS,
    SETUP,
    TIME,
    TRACKING,
    X_PC,
)

__all__ = [
    "METRICS", "PULLEYS", "SETS", "SETUP", "TIME", "TRACKING", "X_PC", "CableLayout", "CaseJob",
    "CaseRun", "CaseRuns", "CaseStudy", "Configuration", "Draw", "DrawnStudy", "Found", "Layout",
    "Metric", "OwnMetric", "Panel", "PanelLayout", "PublishedNumber", "SeededStudy", "as_transform",
    "bars", "between", "camera_belief", "constants_of", "corners_at", "draw_corner_paths",
    "draw_errors", "draw_estimate_angle", "draw_estimate_distance", "draw_estimated_paths",
    "draw_final_places", "draw_image_deviation", "draw_image_paths", "draw_platform_from_above",
    "draw_platform_paths", "draw_positions", "draw_stable", "draw_taut", "draw_velocities", "each",
    "last", "metric", "over_seeds", "paths_layout", "pose_item", "run_case_study", "same_accuracy",
    "trace", "turned",
]  # fmt: skip
