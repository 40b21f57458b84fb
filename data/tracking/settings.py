"""Settings of the stereo front end, with defaults; a TOML file may set some of them."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Count = Annotated[int, Field(ge=1)]
Pixels = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class TrackerSettings(BaseModel):
    """Settings of corner detection, Lucas-Kanade tracking and the checks that end a track."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    max_features: Count = 400
    """most tracks in a frame"""
    grid_rows: Count = 6
    grid_columns: Count = 20
    features_per_cell: Count = 4
    """new corners are detected only in cells with fewer tracks"""
    min_distance: Count = 8
    """px between a new corner and every other track"""
    corner_quality: Annotated[float, Field(gt=0, lt=1)] = 0.002
    """smallest eigenvalue of a corner, as a share of that of the strongest corners of the image"""
    window: Annotated[int, Field(ge=5, le=63)] = 17
    """px, side of the window of Lucas-Kanade"""
    pyramid_levels: Annotated[int, Field(ge=0, le=8)] = 4
    forward_backward: Pixels = 1.0
    """px; a point tracked forward and back has to return within this distance"""
    row_gate: Pixels = 0.6
    """px; largest |vL - vR| of a match in a rectified pair"""
    min_disparity: Pixels = 0.5
    """px"""
    reprojection_gate: Pixels = 1.0
    """px; largest reprojection error, and error of the disparity, under the motion that RANSAC finds"""
    static_share: Annotated[float, Field(gt=0, le=1)] = 0.3
    """smallest share of inliers for which the motion of RANSAC counts; below it no track is ended by it"""
