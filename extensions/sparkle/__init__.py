"""A sparkling plate, photographed: metal flakes in a clear coat under one lamp or several.

Modelled physically: where flakes lie and how they tilt, refraction at the coat's surface, Fresnel's loss on the
way in and out, a lobe about each flake's mirror direction that conserves energy and is the wider the smaller the flake,
lamps far or near and of finite size, a base that darkens with the angle (flop), each eye's own viewpoint, the lens's or
the eye's point spread, the sensor's full well, shot and read noise. Colours are XYZ, or spectra.

Left out: the colour filter array, flakes that hide or light one another, the rings of diffraction, colours that
change with depth or angle, and reflections of the lamps in the coat's own surface. The plate faces the camera squarely.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
