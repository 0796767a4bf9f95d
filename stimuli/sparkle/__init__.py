"""A sparkling plate, photographed: metal flakes in a clear coat under a directional lamp.

What is argued physically: where flakes lie and how they tilt, refraction at the coat's surface, Fresnel's loss on the
way in and out, a lobe about each flake's mirror direction that conserves energy, each eye's own viewpoint, the lens's
point spread, and the sensor's full well. What is left out: shot and read noise, the colour filter array, spectra (the
lamp is one chromaticity), flakes that hide or light one another, diffraction by small flakes, and the base's change
with angle (flop). The plate faces the camera squarely; the lamp is far away, so that its light is parallel.
"""
