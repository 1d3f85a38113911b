/* Every setting of a drive, once; rows as in params.inl. JSON keys of "drive" in a scene's RigidBodies.
 * Directions and points are in the geometry's own frame, as its vertices are: they are scaled, rotated and
 * translated with it. */
PARAM_VEC3(axis, "axis", -1.0f, 0.0f, 0.0f, -1e6f, 1e6f, "", "Forward, where the bow points; any length")
PARAM_FLOAT(start_time, "startTime", 0.0f, -1e6f, 1e6f, "s",
            "Controls have no effect before; 5 s in the authors' runs")
PARAM_FLOAT(thrust, "thrust", 5000.0f, 0.0f, 1e9f, "N", "Thrust at full throttle")
PARAM_ENUM(thrust_at, "thrustAt", 0, "centre|propeller",
           "centre: at the centre of mass and horizontal, as the paper; propeller: at a point, along the "
           "body's axis, as far as that is under water")
PARAM_VEC3(propeller, "propeller", 0.0f, 0.0f, 0.0f, -1e5f, 1e5f, "m", "Where a propeller is")
PARAM_FLOAT(propeller_diameter, "propellerDiameter", 0.45f, 0.01f, 100.0f, "m",
            "Of the jet that a propeller sends onto the rudder")
PARAM_ENUM(steering, "steering", 0, "torque|rudder",
           "torque: about the vertical, as the authors; rudder: the force of the flow on a plate")
PARAM_FLOAT(steering_torque, "steeringTorque", 400.0f, 0.0f, 1e9f, "N m", "Torque at full rudder")
PARAM_VEC3(rudder, "rudder", 0.0f, 0.0f, 0.0f, -1e5f, 1e5f, "m", "Where a rudder is")
PARAM_FLOAT(rudder_area, "rudderArea", 0.01f, 1e-6f, 1e4f, "m^2", "Area of the plate")
PARAM_FLOAT(rudder_aspect, "rudderAspect", 1.5f, 0.1f, 10.0f, "", "Height of the plate over its length")
PARAM_FLOAT(rudder_angle, "rudderAngle", 0.61f, 0.01f, 1.5f, "rad", "Angle at full rudder")
PARAM_ENUM(heading_hold, "headingHold", 0, "proportional|bangbang",
           "proportional: rudder by error and rate of turn; bangbang: always full rudder, as the authors")
PARAM_FLOAT(hold_gain, "holdGain", 4.0f, 0.0f, 1e3f, "1/rad",
            "Rudder for each radian off the heading, up to full rudder")
PARAM_FLOAT(hold_damping, "holdDamping", 3.0f, 0.0f, 1e3f, "s/rad", "Rudder against each rad/s of turn")
PARAM_FLOAT(water_drag, "waterDrag", 0.0f, 0.0f, 1e9f, "N s/m",
            "Extra drag of still water at the centre of mass, horizontal, linear in the speed")
PARAM_FLOAT(water_drag_sq, "waterDragSquare", 0.0f, 0.0f, 1e9f, "N s^2/m^2",
            "The same, quadratic in the speed")
PARAM_FLOAT(air_drag, "airDrag", 0.0f, 0.0f, 1e9f, "N s/m",
            "Extra drag of the air at the centre of mass, horizontal, linear in the speed against the wind")
PARAM_FLOAT(air_drag_sq, "airDragSquare", 0.0f, 0.0f, 1e9f, "N s^2/m^2", "The same, quadratic in the speed")
PARAM_VEC3(wind, "wind", 0.0f, 0.0f, 0.0f, -1e3f, 1e3f, "m/s", "Velocity of the air")
