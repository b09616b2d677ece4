"""
The live page
=============

``quadfringe live`` shows the shape in a browser while it moves, with the four channels, rates and queues. This picture
is taken by ``make figures``, because it needs a browser.
"""

import matplotlib.pyplot as plt

figure = plt.figure(figsize=(10.4, 6.5), layout="none")
axes = figure.add_axes((0, 0, 1, 1))
axes.imshow(plt.imread("../images/live.png"))
axes.set_axis_off()
plt.show()
