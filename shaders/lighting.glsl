// Two directional lights and a sky, attenuated by hair (light volume).

uniform vec3 u_key_direction;   // towards the light, head frame, unit
uniform vec3 u_key_colour;
uniform vec3 u_rim_direction;
uniform vec3 u_rim_colour;
uniform vec3 u_sky_colour;
uniform vec3 u_ground_colour;
uniform sampler3D u_light;      // transmittance towards key and rim light, visible share of the sky
uniform vec3 u_volume_origin;   // lowest corner, metres
uniform vec3 u_volume_size;     // metres

vec3 light_at(vec3 position) {
    return texture(u_light, (position - u_volume_origin) / u_volume_size).rgb;
}

vec3 ambient(float up) { return mix(u_ground_colour, u_sky_colour, 0.5 + 0.5 * up); }
