// Light that reaches a point through hair and head, from a volume around them.

uniform sampler3D u_light;      // transmittance towards key and rim light, visible share of the sky
uniform vec3 u_volume_origin;   // lowest corner, metres
uniform vec3 u_volume_size;     // metres

vec3 light_at(vec3 position) {
    return texture(u_light, (position - u_volume_origin) / u_volume_size).rgb;
}
