"""Two shapes compared pixel by pixel, or a shape with the truth of the bench or a mesh; and why they differ.

`comparing` is the entry; `pixels` and `surface` measure the difference, `alignment` moves a shape onto a surface,
`deviations` and `profiles` sum it up, `causes` names causes, two of them with shots that `synthesis` makes.

>>> import quadfringe as qf
>>> camera = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with qf.open(qf.SystemConfig(camera=camera, scene=qf.SceneConfig(surface="plane", noise=0.01))) as scanner:
...     yesterday, today = scanner.measure(), scanner.measure()
>>> found = qf.compare(today, yesterday)
>>> found.overall.unit, [cause.name for cause in found.causes]
('mm', [])
>>> isinstance(found, ShapeComparison), isinstance(found.right, Deviations), isinstance(found.profiles, dict)
(True, True, True)
>>> all(isinstance(profile, Profile) for profile in found.profiles.values())
True
>>> all(isinstance(cause, Explanation) for cause in found.causes)
True
>>> round(rms(today.depth_mm - yesterday.depth_mm), 1) < 1
True
>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as folder:
...     yesterday.mesh(step=4).save(f"{folder}/yesterday.ply")
...     surface = qf.compare(today, f"{folder}/yesterday.ply")  # against triangles instead of pixels
>>> isinstance(surface, MeshComparison), surface.matched_percent > 90
(True, True)
"""

from quadfringe.decoding.compare.comparing import compare
from quadfringe.decoding.compare.deviations import Deviations, rms
from quadfringe.decoding.compare.profiles import Profile
from quadfringe.decoding.compare.results import Explanation, MeshComparison, ShapeComparison

__all__ = ["Deviations", "Explanation", "MeshComparison", "Profile", "ShapeComparison", "compare", "rms"]
