// Light clipped to what the channels of an eye's display model can give: 0 to 1, as models are normalised. Eye 0 is this
// pass's own, 1 the other.

Real3 within(int eye, Real3 light) {
    return limit(light, 0.0, 1.0);
}
