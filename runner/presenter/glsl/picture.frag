// A picture's codes, one texel to one pixel, on the pixels that are this eye's.

uniform sampler2D codes;          // bottom row first
uniform ivec2 origin;             // texel = origin + direction · pixel
uniform ivec2 direction;          // 1, or -1 where mirrored

out vec4 pixel;

void only_my_pixels();

void main() {
    only_my_pixels();
    pixel = texelFetch(codes, origin + direction * ivec2(gl_FragCoord.xy), 0);
}
