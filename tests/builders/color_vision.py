"""Colors as color-blind readers see them, and how far apart two of them are."""

from collections.abc import Mapping

import numpy as np

from fgbaseline.geometry import FloatArray

DEFICIENCIES: Mapping[str, FloatArray] = {
    "none": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
"""of linear sRGB, at full severity (Machado, Oliveira and Fernandes 2009)"""
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
"""of linear sRGB"""
WHITE = np.array([0.95047, 1.0, 1.08883])


def seen(color: str, deficiency: str) -> FloatArray:
    """(3,) CIELAB coordinates of `#RRGGBB` as it looks to a reader with the deficiency."""
    share = np.frombuffer(bytes.fromhex(color[1:]), np.uint8) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    xyz = XYZ @ np.clip(DEFICIENCIES[deficiency] @ linear, 0.0, 1.0) / WHITE
    x, y, z = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def difference(one: FloatArray, other: FloatArray) -> float:
    """CIEDE2000 of two colors in CIELAB (Sharma, Wu and Dalal 2005)."""
    lightness = np.array([one[0], other[0]])
    a, b = np.array([one[1], other[1]]), np.array([one[2], other[2]])
    power = np.hypot(a, b).mean() ** 7
    a = a * (1.5 - 0.5 * np.sqrt(power / (power + 25.0**7)))
    chroma, hue = np.hypot(a, b), np.rad2deg(np.arctan2(b, a)) % 360.0
    colorless = chroma.prod() == 0.0
    turn = 0.0 if colorless else (hue[1] - hue[0] + 180.0) % 360.0 - 180.0
    mean_hue = hue.sum() if colorless else hue[0] + 0.5 * turn
    mean_lightness, mean_chroma = lightness.mean(), chroma.mean()
    cosines = np.cos(np.deg2rad([mean_hue - 30, 2 * mean_hue, 3 * mean_hue + 6, 4 * mean_hue - 63]))
    t = 1.0 + cosines @ [-0.17, 0.24, 0.32, -0.20]
    squared = (mean_lightness - 50.0) ** 2
    d_lightness = (lightness[1] - lightness[0]) / (1.0 + 0.015 * squared / np.sqrt(20.0 + squared))
    d_chroma = (chroma[1] - chroma[0]) / (1.0 + 0.045 * mean_chroma)
    d_hue = 2.0 * np.sqrt(chroma.prod()) * np.sin(0.5 * np.deg2rad(turn)) / (1.0 + 0.015 * mean_chroma * t)
    power = mean_chroma**7
    angle = 60.0 * np.exp(-((((mean_hue % 360.0) - 275.0) / 25.0) ** 2))
    rotation = -2.0 * np.sqrt(power / (power + 25.0**7)) * np.sin(np.deg2rad(angle))
    return float(np.sqrt(d_lightness**2 + d_chroma**2 + d_hue**2 + rotation * d_chroma * d_hue))
