"""Images, points and depth maps as files. This package knows arrays only; records are in `quadfringe.data`."""
