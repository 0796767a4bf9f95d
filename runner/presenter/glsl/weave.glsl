// Which pixels are this eye's: those whose weave.x · column + weave.y · row + weave.z is even, from the top left.
// All of them where weave is zero. The NumPy twin is runner.presenter.modes.mode.Weave.mask.

uniform ivec3 weave;
uniform int height_px;            // of the framebuffer: OpenGL counts rows from below

void only_my_pixels() {
    ivec2 place = ivec2(int(gl_FragCoord.x), height_px - 1 - int(gl_FragCoord.y));
    if (((weave.x * place.x + weave.y * place.y + weave.z) & 1) != 0) {
        discard;
    }
}
