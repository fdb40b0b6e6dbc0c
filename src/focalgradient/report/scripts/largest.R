show("largest aperture, over subjects and scenes:", largest, crossed)
show("largest aperture, over subjects:", largest, here)
