"""Two shapes compared pixel by pixel, or a shape with the truth of the bench or a mesh; and why they differ.

`comparing` is the entry; `pixels` and `surface` measure the difference, `alignment` moves a shape onto a surface,
`deviations` and `profiles` sum it up, `causes` names causes, two of them with shots that `synthesis` makes.

>>> import quadfringe as qf
>>> with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="plane", noise=0.01))) as scanner:
...     yesterday, today = scanner.measure(), scanner.measure()
>>> found = qf.compare(today, yesterday)
>>> found.overall.unit, [cause.name for cause in found.causes]
('mm', [])
"""

from quadfringe.decoding.compare.comparing import compare
from quadfringe.decoding.compare.deviations import Deviations, rms
from quadfringe.decoding.compare.profiles import Profile
from quadfringe.decoding.compare.results import Explanation, MeshComparison, ShapeComparison

__all__ = ["Deviations", "Explanation", "MeshComparison", "Profile", "ShapeComparison", "compare", "rms"]
