// SPDX-License-Identifier: MIT
import java.lang.reflect.Array;
import java.lang.reflect.Field;
import java.lang.reflect.Modifier;

import lcm.lcm.LCMDataInputStream;
import lcm.logging.Log;
import lcm.spy.LCMTypeDatabase;

/**
 * Decodes a log of LCM messages as lcm-spy does, without its windows: the type is looked for among all classes of the
 * class path by the fingerprint, the first eight bytes of a message. Prints a line for each message: channel, type, and
 * all fields. Ends with status 1 when a type is not found.
 */
public final class SpyCheck {
    private SpyCheck() {
    }

    public static void main(String[] arguments) throws Exception {
        LCMTypeDatabase types = new LCMTypeDatabase();
        Log log = new Log(arguments[0], "r");

        try {
            while (true) {
                Log.Event event = log.readNext();
                long fingerprint = new LCMDataInputStream(event.data).readLong();
                Class<?> type = types.getClassByFingerprint(fingerprint);
                if (type == null) {
                    System.out.println(event.channel + " ?? " + Long.toHexString(fingerprint));
                    System.exit(1);
                }
                Object message = type.getConstructor(java.io.DataInput.class)
                        .newInstance(new LCMDataInputStream(event.data));
                System.out.println(event.channel + " " + type.getName() + fields(message));
            }
        } catch (java.io.EOFException end) {
            log.close();
        }
    }

    private static String fields(Object message) throws IllegalAccessException {
        StringBuilder text = new StringBuilder();

        for (Field field : message.getClass().getFields()) {
            if (!Modifier.isStatic(field.getModifiers())) {
                text.append(' ').append(field.getName()).append('=').append(show(field.get(message)));
            }
        }
        return text.toString();
    }

    private static String show(Object value) {
        if (!value.getClass().isArray()) {
            return value.toString();
        }
        StringBuilder text = new StringBuilder();
        for (int place = 0; place < Array.getLength(value); place++) {
            text.append(place == 0 ? "" : ",").append(Array.get(value, place));
        }
        return text.toString();
    }
}
