// The mean XYZ of a box of pixels, as far as it lies on the picture.

Real3 mean_XYZ(sampler2D picture, ivec2 first, ivec2 box) {
    ivec2 end = min(first + box, textureSize(picture, 0));
    Real3 XYZ = real3(texelFetch(picture, first, 0).rgb);
    if (box == ivec2(1)) {
        return XYZ;
    }
    XYZ = real3(vec3(0.0));
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            XYZ = add(XYZ, texelFetch(picture, ivec2(x, y), 0).rgb);
        }
    }
    return div(XYZ, float((end.x - first.x) * (end.y - first.y)));
}
