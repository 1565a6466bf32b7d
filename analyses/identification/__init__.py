"""Identification of a robot's dynamics from a log: reads, asks, validates, reports, writes a robot.

A log is text with columns that bear their names and units, see `analyses.calibration.read_log`;
those that `cdpr simulate` writes are such. What comes out is a robot file that scenarios take as
what the controller believes, and all numbers as JSON.

Source: see `cdpr_drake.identification`.
"""

from cdpr_drake.analyses.identification.campaign import (
    CAMPAIGN_UNKNOWN,
    DynamicCampaign,
    campaign_robots,
    excitation_task,
    run_dynamic_campaign,
)
from cdpr_drake.analyses.identification.campaign_files import (
    campaign_drawings,
    tracking_table,
    write_dynamic_campaign,
)
from cdpr_drake.analyses.identification.report import (
    identification_dict,
    identification_drawings,
    identification_tables,
    write_identification,
)
from cdpr_drake.analyses.identification.robots import (
    dynamic_model,
    identified_robot,
    platform_size,
)
from cdpr_drake.analyses.identification.task import (
    UNKNOWN,
    Identification,
    IdentificationTask,
    Validation,
    identify,
)

__all__ = [
    "CAMPAIGN_UNKNOWN", "UNKNOWN", "DynamicCampaign", "Identification", "IdentificationTask",
    "Validation", "campaign_drawings", "campaign_robots", "dynamic_model", "excitation_task",
    "identification_dict", "identification_drawings", "identification_tables", "identified_robot",
    "identify", "platform_size", "run_dynamic_campaign", "tracking_table",
    "write_dynamic_campaign", "write_identification",
]  # fmt: skip
